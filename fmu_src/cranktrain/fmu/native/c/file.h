/* resources/native.bin, mapped and checked: the tables of an FMU, whose meaning is described in file_format.py. */
#ifndef CT_FILE_H
#define CT_FILE_H

#include "kernels.h"
#include "resource.h"

#define CT_NONE 0xFFFFFFFFu    /* index that refers to nothing */
#define CT_REFUSED 0x80000000u /* bit of a row of LEVL that contains the text of a refusal */
enum { CT_ALIGNMENT = 64, CT_MOST_DIMENSIONS = 4 };

enum ct_type { CT_REAL, CT_INTEGER, CT_BOOLEAN, CT_STRING, CT_ENUMERATION, CT_TYPES };
enum ct_causality { CT_INPUT, CT_OUTPUT, CT_PARAMETER, CT_LOCAL, CT_CAUSALITIES };
enum ct_choice_kind { CT_LEVEL, CT_NUMBER_CHOICE, CT_CHOICE_KINDS };
enum ct_array_kind { CT_ZEROS, CT_COPIED, CT_SHARED, CT_TRANSPOSED, CT_ARRAY_KINDS };
enum ct_leaf_kind { CT_PLAIN, CT_FUNCTION_LEAF, CT_RECORD_LEAF, CT_LEAF_KINDS };
enum ct_fixup_kind { CT_FUNCTION, CT_RECORD, CT_FIXUP_KINDS };
enum ct_status_kind { CT_STATUS_ERROR, CT_STATUS_DISCARD, CT_STATUS_KINDS };

struct ct_variable {
    uint32_t name, start_text;
    uint8_t type, causality, pad[2];
    uint32_t index; /* index in run.inputs or run.outputs, slot of run.numbers, row of the choices */
    double start, min, max, nominal; /* nominal: typical size of values, 0 if unknown */
    uint32_t first_family, n_families;
};
struct ct_choice { uint32_t name, first_option, n_options, kind, index; };
struct ct_option { uint32_t text, value; double number; };
struct ct_variant {
    uint32_t first_leaf, n_leaves, first_slot, n_slots, first_record, n_records, first_number, n_numbers;
};
struct ct_slot_number { uint32_t slot, pad; double value; };
struct ct_leaf { uint32_t slot, kind; uint64_t value; };
struct ct_record { uint32_t first_leaf, n_leaves; };
struct ct_array {
    uint64_t offset, bytes, shape[CT_MOST_DIMENSIONS];
    uint32_t ndim, itemsize, kind, first_fixup, n_fixups, pad;
};
struct ct_fixup { uint64_t byte_offset; uint32_t kind, index; };
struct ct_well_known { uint32_t name, leaf; };
struct ct_status { int32_t code; uint32_t text, kind, pad; };
struct ct_info { uint32_t name, text; };

/* Leaves of Run that the C side reads or writes. */
enum ct_member { CT_STATE, CT_INPUTS, CT_OUTPUTS, CT_NUMBERS, CT_FAMILIES, CT_INPUT_RATES, CT_STAGED, CT_MEMBERS };
enum { CT_WANTED = 4 }; /* column of families: true if any output of the family is read */
/* Columns of the first row of ``staged``: stages with given inputs, their number, the internal step, rad.
   Each further row is for one stage: its fraction of the step, then its inputs. */
enum { CT_STAGES_GIVEN, CT_STAGES_THERE, CT_STAGE_STEP, CT_STAGED_COLUMNS };

struct ct_file {
    struct ct_map map;
    const struct ct_kernels *kernels; /* kernels to which addresses in the file refer */
    const char *guid;
    const char *texts;
    const struct ct_variable *variables;
    const uint32_t *families; /* rows of run.outputs.families, by output */
    const struct ct_choice *choices;
    const struct ct_option *options;
    const uint32_t *levels;
    const struct ct_variant *variants;
    const struct ct_slot_number *numbers;
    const uint32_t *slots;
    const struct ct_leaf *leaves;
    const struct ct_record *records;
    const struct ct_array *arrays;
    const struct ct_fixup *fixups;
    const struct ct_well_known *well_known;
    const struct ct_status *statuses;
    const struct ct_info *infos;
    const unsigned char *blob;
    uint64_t n_texts, n_variables, n_families, n_choices, n_options, n_levels, n_variants, n_numbers, n_slots, n_leaves,
        n_records, n_arrays, n_fixups, n_well_known, n_statuses, n_infos, n_blob;
    uint32_t members[CT_MEMBERS]; /* leaf of each member, CT_NONE if Run does not have it */
};

/* Map and check native.bin of a resources folder. False if it cannot be used, with the reason in the log. */
bool ct_open_file(const struct ct_host *host, const char *location, const char *guid, struct ct_file *file);
void ct_close_file(struct ct_file *file);

static inline const char *ct_text(const struct ct_file *file, uint32_t offset) { return file->texts + offset; }

/* Array of a member of a variant's Run; NULL if Run does not have the member. */
const struct ct_array *ct_member_array(const struct ct_file *file, const struct ct_variant *variant,
                                       enum ct_member member);

/* Text of the entry of section INFO with this name; NULL if there is no such entry. */
const char *ct_info_text(const struct ct_file *file, const char *name);

/* CRC-32 (IEEE 802.3) of n words, and the sum modulo 2^64 of the words times their numbers from 1 on. */
void ct_sums(const void *bytes, size_t n_words, uint64_t sums[2]);

#endif
