/* What the contact of a force element adds to its table for force in the plane. */
#ifndef PLANE_CONTACT_H
#define PLANE_CONTACT_H

#include <stddef.h>

#include "plane_law.h"

typedef struct plane_contact {
    plane_shape shape;  /* its softening along rolling is that of the element's parameters */
    double axes_ratio;  /* b/a; 0 if the contact knows no spin [1] */
    double spin_arm;    /* creepage that weighs as much as a spin, over spin and a [1] */
    double slip_spread; /* root mean square distance from the centre over a [1] */
} plane_contact;

/* Read a file in memory that is aligned to 8 bytes and must outlive the contact. Returns NULL, or a
 * message that says what is wrong with the bytes. */
CONTACTLIB_API const char *plane_contact_open(plane_contact *contact, const void *bytes,
                                              size_t size);

#endif
