/* Any bytes as a creep table: refused with a message, or a table whose every point can be read. */
#include "checked_file.h"
#include "creep_table.h"
#include "fuzz_input.h"

enum { POINTS = 8 };

/* First a byte whether the frame is mended, so that the fuzzer gets behind the checksum, then the
 * points, then the file. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_input in = {data, size};
    unsigned mended = take_byte(&in) & 1u;
    double x[POINTS], part[POINTS];
    for (int i = 0; i < POINTS; i++) {
        x[i] = take_number(&in);
        part[i] = take_byte(&in) / 255.0;
    }
    size_t length = in.left;
    unsigned char *bytes = room(length, 1); /* aligned to 16 bytes */
    take(&in, bytes, length);
    if (mended && length >= CHECKED_FILE_FRAME)
        checked_file_frame(bytes, length, "CREEPTAB", TABLE_VERSION);

    creep_table table;
    const char *error = creep_table_open(&table, bytes, length);
    if (error == NULL) {
        MUST(table.k_max > 0.0 && table.k_max <= 1e3);
        MUST((const unsigned char *)table.coefficients <= bytes + length);
        for (int i = 0; i < POINTS; i++) {
            creep_value there, back;
            if (!isfinite(x[i])) x[i] = copysign(DBL_MAX, x[i]);
            double k = i % 3 == 0 ? table.k_max : fmin(part[i] * table.k_max, table.k_max);
            if (i % 3 == 1) k = fmin(fabs(x[i]), table.k_max);
            double layer = i % 4 == 0 ? fabs(part[i]) : 0.0;
            creep_table_evaluate(&table, x[i], k, layer, &there);
            creep_table_evaluate(&table, -x[i], k, layer, &back);
            MUST(memcmp(&there.slope, &back.slope, sizeof there.slope) == 0);
            /* Without a tail that falls, all grows with the creepage. */
            if (table.twice_decay < 2 && !table.one_axis) continue;
            MUST(isfinite(there.traction_ratio) && isfinite(there.slope));
            /* A corner's place may be next to nothing. */
            MUST(isfinite(there.log_k_derivative) || table.twice_corner > 0);
            MUST(there.traction_ratio == -back.traction_ratio);
        }
    } else {
        MUST(error[0] != '\0');
    }
    free(bytes);
    return 0;
}
