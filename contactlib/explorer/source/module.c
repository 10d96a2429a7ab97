/* What the page's WebAssembly module adds to the kernel: the structs that hold pointers, which only
 * C lays out. The layout of a struct of doubles is in its header.
 *
 * The page steps one drivetrain at a time, so there is one lane; a lane's numbers do not depend on
 * how many there are. */
#define LANES 1
#define WIDE_SUFFIX portable
#include "wide_functions.h"

static const double ALWAYS = 0.0, UNCHANGED = 1.0;

size_t creep_table_size(void) { return sizeof(creep_table); }

size_t track_size(void) { return sizeof(track); }

/* The same profile under both wheels. */
void track_set(track *rails, size_t count, const double *at, const double *value) {
    *rails = (track){{count, at, value}, {count, at, value}, {1, &ALWAYS, &UNCHANGED}};
}

size_t drivetrain_member_size(void) { return sizeof(drivetrain_member); }

void drivetrain_member_set(drivetrain_member *member, const creep_table *table,
                           const force_element_parameters *contact,
                           const drivetrain_parameters *drivetrain, const track *rails) {
    *member = (drivetrain_member){
        .table = table, .contact = contact, .drivetrain = drivetrain, .rails = rails};
    force_element_scales(contact, contact->nominal_load, 1.0, &member->scales);
}
