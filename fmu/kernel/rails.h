/* Rails of a vehicle from a file: factors along the track, and how slip work changes them. */
#ifndef RAILS_H
#define RAILS_H

#include "track.h"
#include "vehicle.h"

enum { RAILS_VERSION = 1 }; /* of the file's format */

typedef struct vehicle_rails {
    track factors;
    vehicle cleaned; /* without a body and axles */
} vehicle_rails;

/* Open a file in memory that is aligned to 8 bytes and must outlive the rails. Returns NULL, or an
 * error message. */
CONTACTLIB_API const char *vehicle_rails_open(vehicle_rails *rails, const void *bytes, size_t size);

/* Numbers that the slip work needs, and rails without slip work that keep it there. */
CONTACTLIB_API size_t vehicle_rails_numbers(const vehicle_rails *rails);
CONTACTLIB_API void vehicle_rails_begin(vehicle_rails *rails, double *numbers);

/* Whether rails can have these numbers. */
int vehicle_rails_possible(const vehicle_rails *rails, const double *numbers);

#endif
