/* What the page's WebAssembly module adds to the kernel: it fills the structs that hold pointers,
 * and says where all others have their doubles. */
#include <stddef.h>

#include "creep_curve.h"
#include "half_space.h"
#include "track.h"
#include "wheelset.h"
#include "wide.h"

static const double ALWAYS = 0.0, UNCHANGED = 1.0;

/* A stretch of rail with friction times a factor under both wheels. */
typedef struct {
    track rails;
    double at[4], value[4];
} patch;

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

void drivetrain_member_set(drivetrain_member *member, const creep_table *table,
                           const force_element_parameters *contact,
                           const drivetrain_parameters *drivetrain) {
    member->table = table;
    member->contact = contact;
    member->drivetrain = drivetrain;
    force_element_scales(contact, contact->nominal_load, 1.0, &member->scales);
}

void patch_lay(patch *wet, double begins, double ends, double factor, drivetrain_member *member) {
    *wet = (patch){.at = {begins, begins, ends, ends}, .value = {1.0, factor, factor, 1.0}};
    const profile both = {.count = 4, .at = wet->at, .value = wet->value};
    const profile one = {.count = 1, .at = &ALWAYS, .value = &UNCHANGED};
    wet->rails = (track){.left = both, .right = both, .over_time = one, .slope = one};
    member->rails = &wet->rails;
}

void patch_take(drivetrain_member *member) { member->rails = NULL; }
