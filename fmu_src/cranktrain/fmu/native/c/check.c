#include "check.h"

#include <string.h>

/* Names of the members of Run, each with true if Run must have it. */
static const struct {
    char name[15];
    bool needed;
} MEMBERS[CT_MEMBERS] = {
    [CT_STATE] = {"state", true},          [CT_INPUTS] = {"inputs", true},
    [CT_OUTPUTS] = {"outputs", true},      [CT_NUMBERS] = {"numbers", true},
    [CT_FAMILIES] = {"families", false},   [CT_INPUT_RATES] = {"input_rates", false},
    [CT_STAGED] = {"staged", false},
};
static const uint64_t LARGEST = (uint64_t)1 << 40; /* bytes of an array; only damaged files have larger ones */

/* Numbers of the rows that variables refer to, equal in every variant. */
struct counts {
    uint64_t inputs, outputs, numbers, families;
};

static bool within(uint64_t first, uint64_t n, uint64_t all) { return first <= all && n <= all - first; }

static bool is_text(const struct ct_file *file, uint64_t offset) { return offset < file->n_texts; }

static const char *check_array(const struct ct_file *file, const struct ct_array *array) {
    static const char *const PROBLEM = "has an array that does not fit into it";
    uint64_t bytes = array->itemsize;
    if (array->kind >= CT_ARRAY_KINDS || array->ndim > CT_MOST_DIMENSIONS || bytes == 0) return PROBLEM;
    for (uint32_t d = 0; d < array->ndim; ++d) {
        if (array->shape[d] > LARGEST || bytes * array->shape[d] > LARGEST) return PROBLEM;
        bytes *= array->shape[d];
    }
    if (array->bytes != bytes || array->itemsize > LARGEST) return PROBLEM;
    if (array->kind != CT_ZEROS && !within(array->offset, bytes, file->n_blob)) return PROBLEM;
    if (array->kind == CT_SHARED && ((uintptr_t)(file->blob + array->offset) % CT_ALIGNMENT != 0)) return PROBLEM;
    if (array->kind == CT_TRANSPOSED && (array->ndim != 2 || array->itemsize != sizeof(uint64_t))) return PROBLEM;
    if (!within(array->first_fixup, array->n_fixups, file->n_fixups)) return PROBLEM;
    if (array->n_fixups > 0 && array->kind != CT_COPIED) return PROBLEM;
    for (uint32_t k = 0; k < array->n_fixups; ++k) {
        const struct ct_fixup *fixup = file->fixups + array->first_fixup + k;
        if (fixup->kind >= CT_FIXUP_KINDS || !within(fixup->byte_offset, sizeof(uint64_t), bytes)) return PROBLEM;
        if (fixup->kind == CT_FUNCTION && fixup->index >= file->kernels->n_functions) return PROBLEM;
    }
    return NULL;
}

static bool leaves_fit(const struct ct_file *file, const struct ct_variant *variant, uint64_t first, uint64_t n) {
    if (!within(first, n, file->n_leaves)) return false;
    for (const struct ct_leaf *leaf = file->leaves + first; leaf < file->leaves + first + n; ++leaf) {
        if (leaf->slot != CT_NONE) {
            if (leaf->slot >= variant->n_slots) return false;
        } else if (leaf->kind >= CT_LEAF_KINDS || (leaf->kind == CT_FUNCTION_LEAF && leaf->value >= file->kernels->n_functions) ||
                   (leaf->kind == CT_RECORD_LEAF && leaf->value >= variant->n_records)) {
            return false;
        }
    }
    return true;
}

static const char *check_members(const struct ct_file *file, const struct ct_variant *variant, struct counts *least) {
    static const char *const PROBLEM = "lacks an array that the FMU's variables are in";
    uint64_t sizes[CT_MEMBERS] = {0};
    for (int m = 0; m < CT_MEMBERS; ++m) {
        const uint32_t leaf = file->members[m];
        if (leaf == CT_NONE) continue;
        if (leaf >= variant->n_leaves || file->leaves[variant->first_leaf + leaf].slot == CT_NONE) return PROBLEM;
        const struct ct_array *array = ct_member_array(file, variant, (enum ct_member)m);
        if (array->itemsize != sizeof(double) || array->kind == CT_SHARED) return PROBLEM;
        sizes[m] = array->bytes / sizeof(double);
        if (m == CT_FAMILIES && (array->ndim != 2 || array->shape[1] <= CT_WANTED)) return PROBLEM;
        if (m == CT_FAMILIES) sizes[m] = array->shape[0];
        if (m == CT_STAGED && (array->ndim != 2 || array->shape[1] != sizes[CT_INPUTS] + 1)) return PROBLEM;
        if (m == CT_STAGED && (array->shape[0] == 0 || array->shape[1] < CT_STAGED_COLUMNS)) return PROBLEM;
    }
    if (sizes[CT_STATE] == 0) return PROBLEM;
    if (file->members[CT_INPUT_RATES] != CT_NONE && sizes[CT_INPUT_RATES] != sizes[CT_INPUTS]) return PROBLEM;
    if (sizes[CT_INPUTS] < least->inputs) least->inputs = sizes[CT_INPUTS];
    if (sizes[CT_OUTPUTS] < least->outputs) least->outputs = sizes[CT_OUTPUTS];
    if (sizes[CT_NUMBERS] < least->numbers) least->numbers = sizes[CT_NUMBERS];
    if (sizes[CT_FAMILIES] < least->families) least->families = sizes[CT_FAMILIES];
    return NULL;
}

static const char *check_variant(const struct ct_file *file, const struct ct_variant *variant, struct counts *least) {
    static const char *const PROBLEM = "has a variant that does not fit into it";
    if (!within(variant->first_slot, variant->n_slots, file->n_slots) ||
        !within(variant->first_record, variant->n_records, file->n_records) ||
        !within(variant->first_number, variant->n_numbers, file->n_numbers) ||
        !leaves_fit(file, variant, variant->first_leaf, variant->n_leaves)) {
        return PROBLEM;
    }
    for (uint32_t r = 0; r < variant->n_records; ++r) {
        const struct ct_record *record = file->records + variant->first_record + r;
        if (!leaves_fit(file, variant, record->first_leaf, record->n_leaves)) return PROBLEM;
    }
    for (uint32_t s = 0; s < variant->n_slots; ++s) {
        const uint32_t row = file->slots[variant->first_slot + s];
        if (row >= file->n_arrays) return PROBLEM;
        const struct ct_array *array = file->arrays + row;
        for (uint32_t k = 0; k < array->n_fixups; ++k) {
            const struct ct_fixup *fixup = file->fixups + array->first_fixup + k;
            if (fixup->kind == CT_RECORD && fixup->index >= variant->n_records) return PROBLEM;
        }
    }
    const char *problem = check_members(file, variant, least);
    for (uint32_t k = 0; problem == NULL && k < variant->n_numbers; ++k) {
        if (file->numbers[variant->first_number + k].slot >= least->numbers) problem = PROBLEM;
    }
    return problem;
}

static const char *find_members(struct ct_file *file) {
    for (int m = 0; m < CT_MEMBERS; ++m) file->members[m] = CT_NONE;
    for (uint64_t k = 0; k < file->n_well_known; ++k) {
        if (!is_text(file, file->well_known[k].name)) return "has a text that is not there";
        for (int m = 0; m < CT_MEMBERS; ++m) {
            if (strcmp(ct_text(file, file->well_known[k].name), MEMBERS[m].name) == 0) {
                file->members[m] = file->well_known[k].leaf;
            }
        }
    }
    for (int m = 0; m < CT_MEMBERS; ++m) {
        if (MEMBERS[m].needed && file->members[m] == CT_NONE) return "lacks an array that the FMU's variables are in";
    }
    return NULL;
}

static const char *check_choices(const struct ct_file *file, const struct counts *least) {
    static const char *const PROBLEM = "has choices that lead nowhere";
    uint64_t combinations = 1;
    for (const struct ct_choice *choice = file->choices; choice < file->choices + file->n_choices; ++choice) {
        if (!is_text(file, choice->name) || choice->kind >= CT_CHOICE_KINDS || choice->n_options == 0 ||
            !within(choice->first_option, choice->n_options, file->n_options) ||
            (choice->kind == CT_NUMBER_CHOICE && choice->index >= least->numbers)) {
            return PROBLEM;
        }
        for (uint32_t k = 0; k < choice->n_options; ++k) {
            const struct ct_option *option = file->options + choice->first_option + k;
            if (!is_text(file, option->text)) return PROBLEM;
            if (choice->kind == CT_LEVEL && option->value >= choice->n_options) return PROBLEM;
        }
        if (choice->kind == CT_LEVEL) combinations *= choice->n_options;
        if (combinations > file->n_levels) return PROBLEM;
    }
    if (combinations != file->n_levels) return PROBLEM;
    for (uint64_t k = 0; k < file->n_levels; ++k) {
        const uint32_t level = file->levels[k];
        if ((level & CT_REFUSED) != 0 ? !is_text(file, level & ~CT_REFUSED) : level >= file->n_variants) return PROBLEM;
    }
    return NULL;
}

/* True if the start text of a String or Enumeration is among its options. */
static bool starts_at_option(const struct ct_file *file, const struct ct_variable *variable) {
    const struct ct_choice *choice = file->choices + variable->index;
    for (uint32_t k = 0; k < choice->n_options; ++k) {
        const char *text = ct_text(file, file->options[choice->first_option + k].text);
        if (strcmp(text, ct_text(file, variable->start_text)) == 0) return true;
    }
    return false;
}

static bool variable_fits(const struct ct_file *file, const struct ct_variable *variable, const struct counts *least) {
    const bool textual = variable->type == CT_STRING || variable->type == CT_ENUMERATION;
    if (!is_text(file, variable->name) || !is_text(file, variable->start_text) || variable->type >= CT_TYPES ||
        variable->causality >= CT_CAUSALITIES || !within(variable->first_family, variable->n_families, file->n_families)) {
        return false;
    }
    for (uint32_t k = 0; k < variable->n_families; ++k) {
        if (file->families[variable->first_family + k] >= least->families) return false;
    }
    if (variable->causality == CT_INPUT) return !textual && variable->index < least->inputs;
    if (variable->index == CT_NONE) return variable->type != CT_ENUMERATION;
    if (variable->causality == CT_OUTPUT) return !textual && variable->index < least->outputs;
    if (variable->causality == CT_LOCAL) return false;
    if (!textual) return variable->index < least->numbers;
    return variable->index < file->n_choices && starts_at_option(file, variable);
}

const char *ct_check_tables(struct ct_file *file) {
    struct counts least = {UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX};
    if (file->n_texts == 0 || file->texts[0] != '\0' || file->texts[file->n_texts - 1] != '\0') {
        return "has texts without an end";
    }
    const char *problem = find_members(file);
    for (uint64_t k = 0; problem == NULL && k < file->n_arrays; ++k) problem = check_array(file, file->arrays + k);
    for (uint64_t k = 0; problem == NULL && k < file->n_variants; ++k) {
        problem = check_variant(file, file->variants + k, &least);
    }
    if (problem == NULL) problem = check_choices(file, &least);
    if (problem != NULL) return problem;
    for (uint64_t k = 0; k < file->n_variables; ++k) {
        if (!variable_fits(file, file->variables + k, &least)) return "has a variable that leads nowhere";
    }
    for (uint64_t k = 0; k < file->n_statuses; ++k) {
        if (!is_text(file, file->statuses[k].text) || file->statuses[k].kind >= CT_STATUS_KINDS) {
            return "has a status without a text";
        }
    }
    for (uint64_t k = 0; k < file->n_infos; ++k) {
        if (!is_text(file, file->infos[k].name) || !is_text(file, file->infos[k].text)) return "has a text that is not there";
    }
    return NULL;
}
