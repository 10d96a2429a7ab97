#include "rails.h"

#include <math.h>
#include <stdint.h>

#include "checked_file.h"

enum { PROFILES = 5, RANGE_NUMBERS = sizeof(rail_range) / sizeof(double) };

static const double MAX_NODES = 1 << 20, MIN_FACTOR = 1e-300, MAX_FACTOR = 1e6, MAX_GRADE = 1.0;

/* Take the numbers of a profile: their count, places and values. */
static const char *take_profile(profile *p, double lowest, double highest, const double **number,
                                const double *end) {
    if (*number == end || !(**number >= 1.0 && **number <= 0.5 * (double)(end - *number - 1)))
        return "the number of points of a profile is out of range";
    p->count = (size_t)**number;
    if ((double)p->count != **number) return "the number of points of a profile is not whole";
    p->at = *number + 1;
    p->value = p->at + p->count;
    *number = p->value + p->count;
    for (size_t i = 0; i < p->count; i++) {
        if (!(p->value[i] >= lowest && p->value[i] <= highest))
            return "a value of a profile is out of range";
        if ((i > 0 && p->at[i] < p->at[i - 1]) || (i > 1 && p->at[i] == p->at[i - 2]))
            return "the places of a profile are not increasing, each at most twice";
    }
    return NULL;
}

/* The file holds cleaning, recovered, node_distance and the number of nodes, then the profiles in
 * the order of the struct; a right rail of no points is like the left one. */
const char *vehicle_rails_open(vehicle_rails *rails, const void *bytes, size_t size) {
    const double *number;
    size_t count;
    const char *error =
        checked_numbers(bytes, size, "CREEPRAI", RAILS_VERSION, 1e12, &number, &count);
    if (error != NULL) return error;
    if (count < 4) return "the file is too short";
    const double *end = number + count, nodes = number[3];
    int whole = nodes >= 0.0 && nodes <= MAX_NODES && nodes == (double)(uint32_t)nodes;
    if (!whole || ((uint32_t)nodes & ((uint32_t)nodes - 1u)) != 0)
        return "the number of nodes is not a power of two";
    if (!(number[0] >= 0.0) || (nodes > 0.0 && number[0] == 0.0) ||
        !(number[1] >= MIN_FACTOR && number[1] <= MAX_FACTOR) || !(number[2] >= 1e-3))
        return "a number on cleaning is out of range";
    rails->cleaned = (vehicle){.cleaning = number[0],
                               .recovered = number[1],
                               .node_distance = number[2],
                               .nodes = (size_t)nodes};
    track *t = &rails->factors;
    profile *profiles[PROFILES] = {&t->left, &t->right, &t->over_time, &t->slope, &t->grade};
    number += 4;
    for (int i = 0; i < PROFILES && error == NULL; i++) {
        int like_left = i == 1 && number < end && *number == 0.0, is_grade = i == PROFILES - 1;
        if (like_left) *profiles[i] = t->left, number++;
        else
            error = take_profile(profiles[i], is_grade ? -MAX_GRADE : MIN_FACTOR,
                                 is_grade ? MAX_GRADE : MAX_FACTOR, &number, end);
    }
    t->scale = 1.0;
    t->peaks = NULL;
    if (error == NULL && number != end) return "the file is too long";
    return error;
}

size_t vehicle_rails_numbers(const vehicle_rails *rails) {
    return rails->cleaned.nodes > 0 ? RANGE_NUMBERS + 2 * rails->cleaned.nodes : 0;
}

void vehicle_rails_begin(vehicle_rails *rails, double *numbers) {
    if (rails->cleaned.nodes == 0) return;
    rails->cleaned.range = (rail_range *)(void *)numbers;
    rails->cleaned.work = numbers + RANGE_NUMBERS;
    *rails->cleaned.range = (rail_range){.first = 0.0, .last = -1.0};
}

int vehicle_rails_possible(const vehicle_rails *rails, const double *numbers) {
    size_t count = vehicle_rails_numbers(rails);
    for (size_t i = 0; i < count; i++) {
        int whole = i >= 2 || floor(numbers[i]) == numbers[i];
        if (!whole || !(fabs(numbers[i]) <= 1e15) || (i >= 2 && numbers[i] < 0.0)) return 0;
    }
    return 1;
}
