#include "instance.h"

#include <math.h>
#include <string.h>

/* Parts of a point, in this order, each aligned to 64 bytes. */
static const enum ct_member POINT[] = {CT_STATE, CT_INPUTS, CT_INPUT_RATES};
enum { N_POINT = sizeof POINT / sizeof POINT[0] };

static uint64_t part_bytes(const struct ct_file *file, const struct ct_variant *variant, enum ct_member member) {
    const struct ct_array *array = ct_member_array(file, variant, member);
    return array == NULL ? 0 : ct_padded(array->bytes);
}

uint64_t ct_point(const struct ct_file *file, const struct ct_variant *variant) {
    uint64_t bytes = 0;
    for (int part = 0; part < N_POINT; ++part) bytes += part_bytes(file, variant, POINT[part]);
    return bytes / sizeof(double);
}

bool ct_is_point(const struct ct_file *file, const struct ct_variant *variant, const double *numbers) {
    for (int part = 0; part < N_POINT; ++part) {
        const double *end = numbers + part_bytes(file, variant, POINT[part]) / sizeof *numbers;
        for (; numbers < end; ++numbers) {
            const bool not_given = POINT[part] == CT_INPUT_RATES && isnan(*numbers);
            if (!(fabs(*numbers) <= CT_LARGEST || not_given)) return false;
        }
    }
    return true;
}

static uint64_t words_of(const struct ct_file *file, const struct ct_variant *variant, uint32_t first, uint32_t n) {
    uint64_t words = 0;
    for (uint32_t k = first; k < first + n; ++k) {
        const uint32_t slot = file->leaves[k].slot;
        words += slot == CT_NONE ? 1 : 5 + 2 * (uint64_t)file->arrays[file->slots[variant->first_slot + slot]].ndim;
    }
    return words;
}

static uint64_t address_of(const void *pointer) { return (uint64_t)(uintptr_t)pointer; }

/* Image of a tuple's leaves as numba lays them out. An array is its meminfo and parent (none), items, bytes of an
   item, address, shape and strides. */
static void write_image(const struct ct_file *file, const struct ct_variant *variant, uint32_t first, uint32_t n,
                        const uint64_t *slots, const uint64_t *records, uint64_t *image) {
    for (uint32_t k = first; k < first + n; ++k) {
        const struct ct_leaf *leaf = file->leaves + k;
        if (leaf->slot == CT_NONE) {
            *image++ = leaf->kind == CT_FUNCTION_LEAF ? address_of(file->kernels->functions[leaf->value])
                       : leaf->kind == CT_RECORD_LEAF ? records[leaf->value]
                                                      : leaf->value;
            continue;
        }
        const struct ct_array *array = file->arrays + file->slots[variant->first_slot + leaf->slot];
        uint64_t stride = array->itemsize;
        image[0] = image[1] = 0;
        image[2] = array->bytes / array->itemsize;
        image[3] = array->itemsize;
        image[4] = slots[leaf->slot];
        for (uint32_t d = array->ndim; d-- > 0;) {
            image[5 + d] = array->shape[d];
            image[5 + array->ndim + d] = stride;
            stride *= array->shape[d];
        }
        image += 5 + 2 * array->ndim;
    }
}

/* Transpose a matrix of eight-byte words that is stored with its rows as columns. */
static void transpose(const struct ct_array *array, const unsigned char *from, unsigned char *memory) {
    const uint64_t rows = array->shape[0], columns = array->shape[1];
    for (uint64_t i = 0; i < rows; ++i) {
        for (uint64_t j = 0; j < columns; ++j) {
            memcpy(memory, from + (j * rows + i) * sizeof(uint64_t), sizeof(uint64_t));
            memory += sizeof(uint64_t);
        }
    }
}

void ct_fill(const struct ct_file *file, const struct ct_array *array, unsigned char *memory,
             const uint64_t *records) {
    if (array->kind == CT_ZEROS) {
        memset(memory, 0, array->bytes);
        return;
    }
    if (array->kind == CT_TRANSPOSED) {
        transpose(array, file->blob + array->offset, memory);
        return;
    }
    memcpy(memory, file->blob + array->offset, array->bytes);
    for (uint32_t k = 0; k < array->n_fixups; ++k) {
        const struct ct_fixup *fixup = file->fixups + array->first_fixup + k;
        const uint64_t address =
            fixup->kind == CT_FUNCTION ? address_of(file->kernels->functions[fixup->index]) : records[fixup->index];
        memcpy(memory + fixup->byte_offset, &address, sizeof address);
    }
}

static void find_members(struct ct_instance *one, const struct ct_variant *variant, const uint64_t *slots,
                         struct ct_model *model) {
    void *members[CT_MEMBERS] = {NULL};
    for (int m = 0; m < CT_MEMBERS; ++m) {
        if (one->file.members[m] == CT_NONE) continue;
        const struct ct_leaf *leaf = one->file.leaves + variant->first_leaf + one->file.members[m];
        members[m] = (void *)(uintptr_t)slots[leaf->slot];
    }
    model->inputs = members[CT_INPUTS];
    model->outputs = members[CT_OUTPUTS];
    model->numbers = members[CT_NUMBERS];
    model->input_rates = members[CT_INPUT_RATES];
    model->families = members[CT_FAMILIES];
    model->staged = members[CT_STAGED];
    if (model->staged != NULL) {
        const struct ct_array *staged = ct_member_array(&one->file, variant, CT_STAGED);
        model->staged_rows = staged->shape[0];
        model->staged_columns = staged->shape[1];
    }
    if (model->families != NULL) model->columns = ct_member_array(&one->file, variant, CT_FAMILIES)->shape[1];
}

/* Size of a variant's memory block, bytes: addresses of slots and records, images, arrays. Return 0 if too large. */
static uint64_t block_bytes(const struct ct_file *file, const struct ct_variant *variant) {
    uint64_t bytes = ct_padded(((uint64_t)variant->n_slots + variant->n_records) * sizeof(uint64_t));
    bytes += ct_padded(words_of(file, variant, variant->first_leaf, variant->n_leaves) * sizeof(uint64_t));
    for (uint32_t r = 0; r < variant->n_records; ++r) {
        const struct ct_record *record = file->records + variant->first_record + r;
        bytes += ct_padded(words_of(file, variant, record->first_leaf, record->n_leaves) * sizeof(uint64_t));
    }
    for (uint32_t s = 0; s < variant->n_slots; ++s) {
        const struct ct_array *array = file->arrays + file->slots[variant->first_slot + s];
        if (array->kind != CT_SHARED) bytes += ct_padded(array->bytes);
        if (bytes > CT_MOST_BYTES) return 0;
    }
    return bytes + CT_ALIGNMENT;
}

/* Address of a slot in the instance's present point; NULL if the slot is not part of it. */
static unsigned char *place_in_point(const struct ct_instance *one, const struct ct_variant *variant, uint32_t slot) {
    unsigned char *place = (unsigned char *)one->state;
    for (int part = 0; part < N_POINT; ++part) {
        const uint32_t leaf = one->file.members[POINT[part]];
        if (leaf != CT_NONE && one->file.leaves[variant->first_leaf + leaf].slot == slot) return place;
        place += part_bytes(&one->file, variant, POINT[part]);
    }
    return NULL;
}

bool ct_lay_out(struct ct_instance *one, const struct ct_variant *variant, struct ct_model *model) {
    const struct ct_file *file = &one->file;
    const uint64_t bytes = block_bytes(file, variant);
    model->block = bytes == 0 || bytes > SIZE_MAX ? NULL : ct_allocate(&one->host, (size_t)bytes);
    if (model->block == NULL) return false;
    unsigned char *at = (unsigned char *)model->block;
    at += (CT_ALIGNMENT - (uintptr_t)at % CT_ALIGNMENT) % CT_ALIGNMENT;
    uint64_t *slots = (uint64_t *)(void *)at, *records = slots + variant->n_slots;
    at += ct_padded(((uint64_t)variant->n_slots + variant->n_records) * sizeof(uint64_t));
    model->run = at;
    at += ct_padded(words_of(file, variant, variant->first_leaf, variant->n_leaves) * sizeof(uint64_t));
    for (uint32_t r = 0; r < variant->n_records; ++r) {
        const struct ct_record *record = file->records + variant->first_record + r;
        records[r] = address_of(at);
        at += ct_padded(words_of(file, variant, record->first_leaf, record->n_leaves) * sizeof(uint64_t));
    }
    for (uint32_t s = 0; s < variant->n_slots; ++s) {
        const struct ct_array *array = file->arrays + file->slots[variant->first_slot + s];
        if (array->kind == CT_SHARED) {
            slots[s] = address_of(file->blob + array->offset);
            continue;
        }
        unsigned char *place = place_in_point(one, variant, s);
        if (place == NULL) {
            place = at;
            at += ct_padded(array->bytes);
        }
        slots[s] = address_of(place);
        ct_fill(file, array, place, records);
    }
    for (uint32_t r = 0; r < variant->n_records; ++r) {
        const struct ct_record *record = file->records + variant->first_record + r;
        write_image(file, variant, record->first_leaf, record->n_leaves, slots, records,
                    (uint64_t *)(uintptr_t)records[r]);
    }
    write_image(file, variant, variant->first_leaf, variant->n_leaves, slots, records, model->run);
    find_members(one, variant, slots, model);
    return true;
}
