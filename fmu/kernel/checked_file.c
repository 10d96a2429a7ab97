#include "checked_file.h"

#include <math.h>
#include <string.h>

static uint32_t crc32_of(const unsigned char *bytes, size_t size) {
    uint32_t table[256];
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int bit = 0; bit < 8; bit++) c = (c & 1u) ? 0xEDB88320u ^ (c >> 1) : c >> 1;
        table[i] = c;
    }
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0; i < size; i++) crc = table[(crc ^ bytes[i]) & 0xFFu] ^ (crc >> 8);
    return crc ^ 0xFFFFFFFFu;
}

void checked_file_frame(void *bytes, size_t size, const char magic[8], uint32_t version) {
    unsigned char *start = bytes;
    uint64_t whole = size;
    memcpy(start, magic, 8);
    memcpy(start + 8, &version, sizeof version);
    memcpy(start + 16, &whole, sizeof whole);
    uint32_t crc = crc32_of(start + 16, size - 16);
    memcpy(start + 12, &crc, sizeof crc);
}

const char *checked_file_error(const void *bytes, size_t size, const char magic[8],
                               uint32_t version) {
    const unsigned char *start = bytes;
    uint32_t found_version, found_crc;
    uint64_t found_size;
    if (size < CHECKED_FILE_FRAME) return "the file is shorter than its header";
    if (memcmp(start, magic, 8) != 0) return "the file is not of this kind (wrong magic)";
    memcpy(&found_version, start + 8, sizeof found_version);
    memcpy(&found_crc, start + 12, sizeof found_crc);
    memcpy(&found_size, start + 16, sizeof found_size);
    if (found_version < version) return "the file has an older format version";
    if (found_version > version) return "the file has a newer format version";
    if (found_size != size) return "the file's length differs from the one in its header";
    if (found_crc != crc32_of(start + 16, size - 16)) return "the file is damaged (checksum)";
    return NULL;
}

const char *checked_numbers(const void *bytes, size_t size, const char magic[8], uint32_t version,
                            double largest, const double **number, size_t *count) {
    const char *error = checked_file_error(bytes, size, magic, version);
    if (error != NULL) return error;
    *number = (const double *)(const void *)((const char *)bytes + CHECKED_FILE_FRAME);
    *count = (size - CHECKED_FILE_FRAME) / sizeof **number;
    if (size % sizeof **number != 0) return "the file ends within a number";
    for (size_t i = 0; i < *count; i++)
        if (!(fabs((*number)[i]) <= largest)) return "a number is not finite or too large";
    return NULL;
}
