/* FMU states: copies of an instance's ``now``. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "instance.h"

static const char FOREIGN[] = "the FMU state is not one of cranktrain; serialize it from an instance of this FMU";
static const char OTHER_BUILD[] = "the FMU state comes from another build of the FMU; serialize it from this one";
static const char DAMAGED[] = "the FMU state is damaged (checksum differs); serialize it again";
static const char IMPOSSIBLE[] = "the FMU state is not one of a run: its numbers cannot be; serialize it from a run";
static const char MAGIC[8] = "CRNKNST";

static bool is_state(const struct ct_snapshot *state) { return memcmp(state->magic, MAGIC, sizeof MAGIC) == 0; }

static ct_result no_state(const struct ct_instance *one) {
    return ct_refuse(&one->host, "no FMU state, or no place for one, was given");
}

static bool is_running(const struct ct_snapshot *state) { return state->phase >= CT_STEPPED; }

/* Length, bytes, of the part of an FMU state before its points. */
static uint64_t head_bytes(const struct ct_instance *one) { return (uint64_t)((char *)one->state - (char *)one->now); }

static uint64_t point_bytes(const struct ct_snapshot *state) {
    return (1 + CT_PLACES) * (uint64_t)state->n_point * sizeof(double);
}

ct_result ct_get_state(struct ct_instance *one, void **state) {
    const bool running = is_running(one->now);
    const uint64_t bytes = head_bytes(one) + (running ? point_bytes(one->now) : 0);
    if (state == NULL) return no_state(one);
    struct ct_snapshot *snapshot = *state;
    if (snapshot != NULL && !is_state(snapshot)) return ct_refuse(&one->host, "%s", FOREIGN);
    if (snapshot != NULL && snapshot->capacity < bytes) {
        ct_release(&one->host, snapshot);
        *state = snapshot = NULL;
    }
    if (snapshot == NULL) {
        snapshot = ct_allocate(&one->host, (size_t)bytes);
        if (snapshot == NULL) return ct_refuse(&one->host, "no memory for an FMU state");
        snapshot->capacity = bytes;
        *state = snapshot;
    }
    const uint64_t capacity = snapshot->capacity;
    memcpy(snapshot, one->now, (size_t)bytes);
    snapshot->capacity = capacity;
    snapshot->bytes = bytes;
    if (!running) snapshot->n_point = snapshot->n_past = snapshot->latest = snapshot->variant = 0;
    return CT_OK;
}

ct_result ct_free_state(struct ct_instance *one, void **state) {
    if (state == NULL) return CT_OK;
    ct_release(&one->host, *state);
    *state = NULL;
    return CT_OK;
}

ct_result ct_state_size(struct ct_instance *one, const void *state, size_t *size) {
    if (state == NULL || size == NULL || !is_state(state)) return no_state(one);
    *size = (size_t)((const struct ct_snapshot *)state)->bytes;
    return CT_OK;
}

/* True if a variable can have this value. Outputs may have any value, because they are computed again. */
static bool can_be(const struct ct_file *file, const struct ct_variable *variable, double value) {
    if (variable->type == CT_STRING || variable->type == CT_ENUMERATION) {
        const uint32_t n = variable->index == CT_NONE ? 1 : file->choices[variable->index].n_options;
        return value >= 0.0 && value < n && value == (uint32_t)value;
    }
    if (variable->causality != CT_PARAMETER && variable->causality != CT_INPUT) return true;
    return isfinite(value) && variable->min <= value && value <= variable->max;
}

/* True if an instance could have the numbers of a state; a serialized state may come from anywhere. */
static bool has_sound_numbers(const struct ct_instance *one, const struct ct_snapshot *state) {
    const double *values = (const double *)(const void *)(state + 1);
    const double *rates = values + one->n_variables, *origin = rates + one->n_inputs;
    const double *points = (const double *)(const void *)((const char *)state + head_bytes(one));
    if (!(fabs(state->start_time) <= CT_LARGEST && fabs(state->end_time) <= CT_LARGEST)) return false;
    if (isnan(state->stop_time)) return false;
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        if (!can_be(&one->file, one->file.variables + k, values[k])) return false;
    }
    for (uint32_t k = 0; k < one->n_inputs; ++k) {
        const struct ct_variable *variable = one->file.variables + one->inputs[k].reference;
        /* The inputs at the start (origin) exist only if the instance has started. */
        if (is_running(state) && !can_be(&one->file, variable, origin[k])) return false;
        if (!(isnan(rates[k]) || fabs(rates[k]) <= DBL_MAX)) return false;
    }
    for (int k = 0; k < 1 + CT_PLACES && is_running(state); ++k) {
        const struct ct_variant *variant = one->file.variants + state->variant;
        if (!ct_is_point(&one->file, variant, points + (size_t)k * state->n_point)) return false;
    }
    return true;
}

/* Reason why an FMU state of this length cannot be set. Return NULL if it can be set. */
static const char *check_state(const struct ct_instance *one, const struct ct_snapshot *state, uint64_t bytes) {
    const uint32_t phase = state->phase;
    if (!is_state(state)) return FOREIGN;
    if (state->version != one->now->version || memcmp(state->guid, one->now->guid, sizeof state->guid) != 0) {
        return OTHER_BUILD;
    }
    if (phase == 0 || phase > CT_EVENT || (phase & (phase - 1)) != 0) return DAMAGED;
    if (is_running(state)) {
        if (state->variant >= one->file.n_variants) return DAMAGED;
        const struct ct_variant *variant = one->file.variants + state->variant;
        if (ct_point(&one->file, variant) != state->n_point) return DAMAGED;
        if (state->n_past > CT_PAST || state->latest >= CT_PLACES) return DAMAGED;
    } else if (state->n_point != 0) {
        return DAMAGED;
    }
    if (state->bytes != bytes || bytes != head_bytes(one) + point_bytes(state)) return DAMAGED;
    return has_sound_numbers(one, state) ? NULL : IMPOSSIBLE;
}

/* True if an FMU state was taken from the model that the instance has now. */
static bool same_model(const struct ct_instance *one, const struct ct_snapshot *state) {
    const double *values = (const double *)(const void *)(state + 1);
    const double *origin = values + one->n_variables + one->n_inputs;
    if (!one->made || state->variant != one->now->variant || state->start_time != one->now->start_time) return false;
    if (memcmp(origin, one->origin, one->n_inputs * sizeof *origin) != 0) return false;
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        if (one->file.variables[k].causality == CT_PARAMETER && values[k] != one->values[k]) return false;
    }
    return true;
}

static void take_over(struct ct_instance *one, const struct ct_snapshot *state) {
    const uint64_t capacity = one->now->capacity;
    memcpy(one->now, state, (size_t)state->bytes);
    one->now->capacity = capacity;
}

ct_result ct_set_state(struct ct_instance *one, const void *given) {
    const struct ct_snapshot *state = given;
    if (state == NULL) return no_state(one);
    const char *problem = check_state(one, state, state->bytes);
    if (problem != NULL) return ct_refuse(&one->host, "%s", problem);
    if (is_running(state) && !same_model(one, state)) {
        /* Prepare the model of the state's values; its start is then overwritten by the state's points. */
        struct ct_snapshot *before = ct_allocate(&one->host, (size_t)one->now->capacity);
        if (before == NULL) return ct_refuse(&one->host, "no memory to set an FMU state");
        memcpy(before, one->now, (size_t)one->now->capacity);
        take_over(one, state);
        const ct_result status =
            ct_level(one) == state->variant ? ct_make(one) : ct_refuse(&one->host, "%s", DAMAGED);
        if (status != CT_OK) memcpy(one->now, before, (size_t)before->capacity);
        ct_release(&one->host, before);
        if (status != CT_OK) return status;
    }
    take_over(one, state);
    one->made = is_running(state);
    ct_forget_outputs(one);
    return CT_OK;
}

ct_result ct_serialize(struct ct_instance *one, const void *given, void *bytes, size_t size) {
    const struct ct_snapshot *state = given;
    struct ct_snapshot head;
    if (state == NULL || bytes == NULL) return no_state(one);
    if (!is_state(state)) return ct_refuse(&one->host, "%s", FOREIGN);
    if (size < state->bytes) {
        return ct_refuse(&one->host, "a serialized FMU state takes %.0f bytes, not %.0f; ask for its size",
                         (double)state->bytes, (double)size);
    }
    memcpy(bytes, state, (size_t)state->bytes);
    memcpy(&head, bytes, sizeof head);
    head.sums[0] = head.sums[1] = head.capacity = 0;
    memcpy(bytes, &head, sizeof head);
    ct_sums(bytes, (size_t)state->bytes / sizeof(uint64_t), head.sums);
    memcpy(bytes, &head, sizeof head);
    return CT_OK;
}

ct_result ct_deserialize(struct ct_instance *one, const void *bytes, size_t size, void **state) {
    struct ct_snapshot head;
    uint64_t sums[2];
    if (bytes == NULL || state == NULL) return no_state(one);
    if (size < sizeof head) return ct_refuse(&one->host, "%s", FOREIGN);
    memcpy(&head, bytes, sizeof head);
    if (!is_state(&head)) return ct_refuse(&one->host, "%s", FOREIGN);
    if (head.bytes > size || head.bytes < sizeof head || head.bytes % sizeof(uint64_t) != 0) {
        return ct_refuse(&one->host, "%s", DAMAGED);
    }
    struct ct_snapshot *copy = ct_allocate(&one->host, (size_t)head.bytes);
    if (copy == NULL) return ct_refuse(&one->host, "no memory for an FMU state");
    memcpy(copy, bytes, (size_t)head.bytes);
    copy->sums[0] = copy->sums[1] = 0;
    ct_sums(copy, (size_t)head.bytes / sizeof(uint64_t), sums);
    const char *problem = sums[0] != head.sums[0] || sums[1] != head.sums[1] ? DAMAGED : NULL;
    /* A state of another build is recognised first, because its other contents may differ as well. */
    if (head.version != one->now->version || memcmp(head.guid, one->now->guid, sizeof head.guid) != 0) {
        problem = OTHER_BUILD;
    }
    if (problem == NULL) problem = check_state(one, copy, head.bytes);
    if (problem != NULL) {
        ct_release(&one->host, copy);
        return ct_refuse(&one->host, "%s", problem);
    }
    copy->capacity = head.bytes;
    *state = copy;
    return CT_OK;
}
