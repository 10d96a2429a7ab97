/* What the page's WebAssembly module adds to the kernel: it fills the structs that hold pointers,
 * and says where all others have their doubles. */
#include <stddef.h>

#include "creep_curve.h"
#include "half_space.h"
#include "track.h"
#include "wheelset.h"
#include "wide.h"

static const double ALWAYS = 0.0, UNCHANGED = 1.0;

static const struct {
    const char *name; /* of a struct, or of a double in it: "wheelset_rates.jacobian[0][1]" */
    size_t bytes;     /* the struct's size, or the double's offset */
} MEMBERS[] = {
#include "members.h" /* which the build lists from the headers */
};

/* NULL behind the last one. */
const char *member_name(size_t i) {
    return i < sizeof MEMBERS / sizeof *MEMBERS ? MEMBERS[i].name : NULL;
}

size_t member_bytes(size_t i) { return MEMBERS[i].bytes; }

/* The same friction under both wheels. */
void track_set(track *rails, size_t count, const double *at, const double *value) {
    const profile both = {.count = count, .at = at, .value = value};
    const profile one = {.count = 1, .at = &ALWAYS, .value = &UNCHANGED};
    *rails = (track){.left = both, .right = both, .over_time = one, .slope = one};
}

void drivetrain_member_set(drivetrain_member *member, const creep_table *table,
                           const force_element_parameters *contact,
                           const drivetrain_parameters *drivetrain, const track *rails) {
    *member = (drivetrain_member){
        .table = table, .contact = contact, .drivetrain = drivetrain, .rails = rails};
    force_element_scales(contact, contact->nominal_load, 1.0, &member->scales);
}
