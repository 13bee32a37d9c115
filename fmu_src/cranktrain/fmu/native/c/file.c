#include "file.h"

#include <string.h>

#include "check.h"

static const char MAGIC[8] = "CRNKNAT";
static const char NAME[] = "native.bin";
static const char REMEDY[] = "build the FMU again with build_fmu.py --native, or unpack it again";
enum { VERSION = 3, BYTE_ORDER_MARK = 0x01020304, OTHER_ORDER = 0x04030201, GUID_BYTES = 40, DIGEST_BYTES = 16 };

struct header {
    char magic[8];
    uint32_t version, order;
    uint64_t size;
    char digest[DIGEST_BYTES], guid[GUID_BYTES];
    uint64_t sums[2];
    uint32_t n_sections, pad; /* checksums cover the file from here on */
};
struct entry {
    char name[8];
    uint64_t offset, bytes, rows;
};
static const size_t SUMMED = offsetof(struct header, n_sections);

_Static_assert(sizeof(struct header) == 104 && sizeof(struct entry) == 32, "layout of the file");
_Static_assert(sizeof(struct ct_variable) == 56 && sizeof(struct ct_choice) == 20, "layout of the file");
_Static_assert(sizeof(struct ct_option) == 16 && sizeof(struct ct_variant) == 32, "layout of the file");
_Static_assert(sizeof(struct ct_slot_number) == 16 && sizeof(struct ct_leaf) == 16, "layout of the file");
_Static_assert(sizeof(struct ct_record) == 8 && sizeof(struct ct_array) == 72, "layout of the file");
_Static_assert(sizeof(struct ct_fixup) == 16 && sizeof(struct ct_well_known) == 8, "layout of the file");
_Static_assert(sizeof(struct ct_status) == 16 && sizeof(struct ct_info) == 8, "layout of the file");

/* Pointers to the rows of each section and to their number, and the size of a row. */
#define SECTION(name, member) {name, offsetof(struct ct_file, member), offsetof(struct ct_file, n_##member), \
                               sizeof(*((struct ct_file *)0)->member)}
static const struct {
    char name[8];
    size_t rows, count, row_bytes;
} SECTIONS[] = {
    SECTION("TEXT", texts),      SECTION("VARS", variables), SECTION("FAMS", families), SECTION("CHOI", choices),
    SECTION("OPTN", options),    SECTION("LEVL", levels),    SECTION("VARI", variants), SECTION("NUMB", numbers),
    SECTION("SLOT", slots),      SECTION("LEAF", leaves),    SECTION("RECS", records),  SECTION("ARRY", arrays),
    SECTION("FIXU", fixups),     SECTION("NAME", well_known), SECTION("STAT", statuses), SECTION("INFO", infos),
    SECTION("BLOB", blob),
};
enum { N_SECTIONS = sizeof SECTIONS / sizeof SECTIONS[0] };

/* Remainders of CRC-32 (IEEE 802.3) for a byte that is followed by 0 to 7 other bytes. */
static void fill_remainders(uint32_t remainders[8][256]) {
    for (uint32_t byte = 0; byte < 256; ++byte) {
        uint32_t r = byte;
        for (int bit = 0; bit < 8; ++bit) r = (r >> 1) ^ ((r & 1) != 0 ? 0xEDB88320u : 0);
        remainders[0][byte] = r;
    }
    for (int k = 1; k < 8; ++k) {
        for (uint32_t byte = 0; byte < 256; ++byte) {
            const uint32_t before = remainders[k - 1][byte];
            remainders[k][byte] = (before >> 8) ^ remainders[0][before & 0xFF];
        }
    }
}

void ct_sums(const void *bytes, size_t n_words, uint64_t sums[2]) {
    const unsigned char *at = bytes;
    uint32_t remainders[8][256], crc = 0xFFFFFFFFu;
    uint64_t second = 0;
    fill_remainders(remainders);
    for (size_t i = 0; i < n_words; ++i, at += sizeof(uint64_t)) {
        uint64_t word;
        memcpy(&word, at, sizeof word);
        second += (i + 1) * word;
        word ^= crc; /* machines are little-endian like the file */
        crc = 0;
        for (int k = 0; k < 8; ++k) crc ^= remainders[7 - k][(word >> (8 * k)) & 0xFF];
    }
    sums[0] = crc ^ 0xFFFFFFFFu;
    sums[1] = second;
}

/* Check the header of a file of this size. Return the fault as text, or NULL if there is none. */
static const char *check_header(const struct header *header, size_t size) {
    uint64_t sums[2];
    if (size < sizeof *header || memcmp(header->magic, MAGIC, sizeof MAGIC) != 0) {
        return "is not the data of a native FMU of cranktrain";
    }
    if (header->order == OTHER_ORDER) return "is of another order of bytes";
    if (header->order != BYTE_ORDER_MARK || header->version != VERSION) return "is of another version";
    if (header->size != size || size % sizeof(uint64_t) != 0) return "is cut short, or longer than it says";
    ct_sums((const unsigned char *)header + SUMMED, (size - SUMMED) / sizeof(uint64_t), sums);
    if (sums[0] != header->sums[0] || sums[1] != header->sums[1]) return "has changed since it was written";
    if (memchr(header->guid, '\0', GUID_BYTES) == NULL) return "has no GUID";
    return NULL;
}

/* Find all sections of a file. Return the fault as text, or NULL if each section exists once. */
static const char *find_sections(struct ct_file *file, const struct header *header) {
    const struct entry *entries = (const struct entry *)(const void *)(header + 1);
    uint32_t found = 0;
    if (header->n_sections != N_SECTIONS) return "has not the sections that it must have";
    if (file->map.size < sizeof *header + N_SECTIONS * sizeof *entries) return "is cut short";
    for (uint32_t k = 0; k < N_SECTIONS; ++k) {
        const struct entry *entry = entries + k;
        uint32_t s = 0;
        while (s < N_SECTIONS && memcmp(entry->name, SECTIONS[s].name, sizeof entry->name) != 0) ++s;
        if (s == N_SECTIONS || (found >> s & 1u) != 0) return "has not the sections that it must have";
        found |= 1u << s;
        if (entry->offset % sizeof(uint64_t) != 0 || entry->offset > file->map.size ||
            entry->bytes > file->map.size - entry->offset || entry->rows >= CT_NONE ||
            entry->rows * SECTIONS[s].row_bytes != entry->bytes) {
            return "has a section that does not fit into it";
        }
        const void *rows = file->map.bytes + entry->offset;
        memcpy((char *)file + SECTIONS[s].rows, &rows, sizeof rows);
        memcpy((char *)file + SECTIONS[s].count, &entry->rows, sizeof entry->rows);
    }
    return NULL;
}

/* True if the library has the kernels of solved films that the data may need (second part of the digest). */
static bool has_films(const struct ct_file *file) {
    const char *films = ct_info_text(file, "films"), *second = strchr(file->kernels->digest, ' ');
    return films == NULL || (second != NULL && strcmp(second + 1, films) == 0);
}

bool ct_open_file(const struct ct_host *host, const char *location, const char *guid, struct ct_file *file) {
    memset(file, 0, sizeof *file);
    file->kernels = ct_choose_kernels();
    if (!ct_map_resource(host, location, NAME, &file->map)) return false;
    const struct header *header = (const struct header *)(const void *)file->map.bytes;
    const char *problem = check_header(header, file->map.size);
    if (problem == NULL) problem = find_sections(file, header);
    if (problem == NULL && strncmp(header->digest, file->kernels->digest, DIGEST_BYTES) != 0) {
        problem = "is for other machine code than this binary";
    }
    if (problem == NULL) problem = ct_check_tables(file);
    if (problem == NULL && !has_films(file)) problem = "is for other machine code than this binary";
    if (problem != NULL) {
        ct_refuse(host, "resources/%s %s; %s", NAME, problem, REMEDY);
        ct_close_file(file);
        return false;
    }
    file->guid = header->guid;
    if (strcmp(guid, file->guid) != 0) {
        ct_refuse(host, "the GUID %.60s is not this FMU's, %s; binary, data and modelDescription.xml must be of one build",
                  guid, file->guid);
        ct_close_file(file);
        return false;
    }
    return true;
}

void ct_close_file(struct ct_file *file) { ct_unmap(&file->map); }

const struct ct_array *ct_member_array(const struct ct_file *file, const struct ct_variant *variant,
                                       enum ct_member member) {
    const uint32_t leaf = file->members[member];
    if (leaf == CT_NONE) return NULL;
    const uint32_t slot = file->leaves[variant->first_leaf + leaf].slot;
    return file->arrays + file->slots[variant->first_slot + slot];
}

const char *ct_info_text(const struct ct_file *file, const char *name) {
    for (uint64_t k = 0; k < file->n_infos; ++k) {
        if (strcmp(ct_text(file, file->infos[k].name), name) == 0) return ct_text(file, file->infos[k].text);
    }
    return NULL;
}
