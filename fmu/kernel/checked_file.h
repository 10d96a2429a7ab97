/* The frame of all contactlib's binary files: magic, version, size, checksum.
 *
 *     offset 0   8 bytes   magic
 *            8   uint32    format version
 *           12   uint32    CRC-32 (zlib's) of all bytes from offset 16 on
 *           16   uint64    size of the whole file
 *           24   ...       contents, little-endian
 */
#ifndef CHECKED_FILE_H
#define CHECKED_FILE_H

#include <stddef.h>
#include <stdint.h>

enum { CHECKED_FILE_FRAME = 24 };

/* Write the frame in front of contents that already stand in bytes from CHECKED_FILE_FRAME on. */
void checked_file_frame(void *bytes, size_t size, const char magic[8], uint32_t version);

/* Returns NULL, or an error message if these bytes are no such file. */
const char *checked_file_error(const void *bytes, size_t size, const char magic[8],
                               uint32_t version);

/* The doubles of such a file, aligned to 8 bytes, and how many there are; none is larger. */
const char *checked_numbers(const void *bytes, size_t size, const char magic[8], uint32_t version,
                            double largest, const double **number, size_t *count);

#endif
