/* An FMU of three wheels, or of a vehicle's three axles, in both versions of FMI: each value is
 * that of its wheel, messages name the wheel, and damaged start values and rails are refused.
 *
 *     test_wheels RESOURCES TOKEN KIND FOLDER
 *
 * RESOURCES is a URI, and FOLDER the path of the resources. The wheels differ in static friction.
 */
#include "checked_file.h"
#include "checks.h"
#include "component.h"
#include "file_io.h"
#include "fmi.h"

enum { WHEELS = 3, AT_MOST = 64 };

static const model *kind;
static const char *resources, *token;
static int messages;

#define FINE(call) CHECK((int)(call) <= RESULT_WARNING)
/* A call that fails with a message that contains a text. */
#define REFUSED(text, call)                  \
    do {                                     \
        int before_ = messages;              \
        must_say = (text);                   \
        CHECK((int)(call) > RESULT_WARNING); \
        CHECK(messages == before_ + 1);      \
        must_say = "";                       \
    } while (0)

static unsigned index_of(const char *name) {
    unsigned i = 0;
    while (i < kind->count && strcmp(kind->variables[i].name, name) != 0) i++;
    return i;
}

/* References of a variable of each wheel, one of them in FMI 3, and their number. */
static size_t each(const fmi *v, const char *name, unsigned *references) {
    unsigned index = index_of(name);
    for (unsigned i = 0; i < WHEELS; i++) references[i] = index + i * MAX_VARIABLES;
    return v->version == 3 ? 1 : WHEELS;
}

/* Place in the file of start values of the first value of a variable. */
static size_t place_of(const char *name) {
    void *c = fmi_of(2)->open(0, token, resources, 1, &messages);
    size_t at = 2;
    for (unsigned i = 0; i < index_of(name); i++)
        if (model_is_given(&kind->variables[i]))
            at += 1 + (((component *)c)->is_common[i] ? 1 : WHEELS);
    fmi_of(2)->close(c);
    return at;
}

static int set(const fmi *v, void *c, const char *name, const double *values) {
    unsigned of[WHEELS];
    size_t n = each(v, name, of);
    return v->version == 3 ? (int)fmi3SetFloat64(c, of, n, values, WHEELS)
                           : v->set(c, of, n, values);
}

static int get(const fmi *v, void *c, const char *name, double *values) {
    unsigned of[WHEELS];
    size_t n = each(v, name, of);
    return v->version == 3 ? (int)fmi3GetFloat64(c, of, n, values, WHEELS)
                           : v->get(c, of, n, values);
}

static void test_steps(const fmi *v) {
    double load[WHEELS] = {1e5, 9e4, 8e4}, force[WHEELS] = {0.0}, before[WHEELS] = {0.0};
    void *c = v->open(0, token, resources, 1, &messages), *saved = NULL;
    FINE(start(v, c, 0.0));
    FINE(set(v, c, "normal_load", load));
    for (int i = 0; i < 20; i++) FINE(v->step(c, 1e-3 * i, 1e-3));
    FINE(get(v, c, "creep_force", before));
    FINE(v->save(c, &saved));
    load[1] = 5e4;
    FINE(set(v, c, "normal_load", load));
    FINE(v->step(c, 0.02, 1e-3));
    FINE(get(v, c, "creep_force", force));
    CHECK(force[1] != before[1] || before[1] == 0.0);
    FINE(v->restore(c, saved));
    FINE(get(v, c, "creep_force", force));
    for (int i = 0; i < WHEELS; i++) CHECK(force[i] == before[i]);
    FINE(v->forget(c, &saved));
    double across[WHEELS] = {0.02, 0.01, 0.03};
    FINE(set(v, c, "lateral_velocity", across));
    FINE(v->step(c, 0.02, 1e-3));
    FINE(get(v, c, "lateral_force", force));
    for (int i = 0; i < WHEELS; i++) CHECK(force[i] < 0.0);
    load[2] = 1e13;
    REFUSED("normal_load[3] = 1e+13", set(v, c, "normal_load", load));
    load[2] = 8e4;
    double friction[WHEELS] = {0.45, 0.01, 0.45};
    FINE(set(v, c, "static_friction", friction));
    REFUSED("wheel 2: static_friction = 0.01", get(v, c, "k_hat", force));
    unsigned wrong[2] = {index_of("kinetic_friction") + MAX_VARIABLES,
                         index_of("normal_load") + WHEELS * MAX_VARIABLES};
    for (int i = 0; i < 2; i++) REFUSED("is not a real variable", v->get(c, &wrong[i], 1, force));
    v->close(c);
}

static void test_exchange(const fmi *v) {
    void *c = v->open(1, token, resources, 1, &messages);
    double x[AT_MOST], rates[AT_MOST], omega[WHEELS] = {20.0, 20.1, 20.2}, seed[WHEELS] = {0.0};
    double force[WHEELS] = {0.0}, change[WHEELS] = {0.0};
    size_t states = component_states(c), indicators = component_indicators(c);
    unsigned of[WHEELS], by[WHEELS];
    FINE(start(v, c, 0.0));
    FINE(v->update(c));
    FINE(v->continuous(c));
    FINE(v->set_time(c, 0.5));
    CHECK(states % WHEELS == 0 && indicators == WHEELS * FLAG_COUNT);
    FINE(set(v, c, "omega", omega));
    FINE(v->get_states(c, x, states));
    FINE(v->set_states(c, x, states));
    FINE(v->get_rates(c, rates, states));
    FINE(v->get_nominals(c, x, states));
    for (size_t i = 0; i < states; i++) CHECK(isfinite(rates[i]) && x[i] > 0.0);
    FINE(v->get_indicators(c, x, indicators));
    FINE(get(v, c, "creep_force", force));
    size_t n = each(v, "creep_force", of);
    each(v, "omega", by);
    seed[1] = 1.0;
    if (v->version == 3) {
        FINE(fmi3GetDirectionalDerivative(c, of, n, by, n, seed, WHEELS, change, WHEELS));
        CHECK(change[0] == 0.0 && change[2] == 0.0);
        double transposed[WHEELS];
        FINE(fmi3GetAdjointDerivative(c, of, n, by, n, seed, WHEELS, transposed, WHEELS));
        CHECK(transposed[1] == change[1]);
        unsigned common = index_of("kinetic_friction"), own = index_of("static_friction");
        FINE(fmi3GetAdjointDerivative(c, of, n, &common, 1, seed, WHEELS, transposed, 1));
        FINE(fmi3GetAdjointDerivative(c, of, n, &own, 1, seed, WHEELS, transposed, WHEELS));
    } else {
        FINE(v->derivative(c, 0, of, n, by, n, seed, change));
        CHECK(change[0] == 0.0 && change[2] == 0.0);
        if (kind->variables[by[0]].role != STATE)
            REFUSED("omega[2] cannot be the unknown",
                    v->derivative(c, 0, &by[1], 1, by, 1, seed, change));
    }
    unsigned rate = index_of("der(held_force)");
    rate += MAX_VARIABLES;
    if (states > 0 && v->version == 2)
        REFUSED("der(held_force[2]) cannot be set", v->set(c, &rate, 1, seed));
    v->close(c);
}

/* Loads move between axles and stay the weight; a saved state brings them back; and axles that
 * cannot be are refused. */
static void test_axles(const fmi *v) {
    static const struct {
        const char *name, *text;
        double value[WHEELS];
    } wrong[] = {{"axles", "axles = 2 must be 3", {2.0}},
                 {"axles_per_bogie", "axles_per_bogie = 2 must give", {2.0}},
                 {"position", "position[3] = 2 is out of range: must be above", {0.0, 2.0, 2.0}}};
    double torque[WHEELS] = {1e3, 2e3, 3e3}, before[WHEELS], load[WHEELS], after[WHEELS];
    void *c = v->open(0, token, resources, 1, &messages), *saved = NULL, *taken = NULL;
    FINE(start(v, c, 0.0));
    FINE(get(v, c, "axle_load", before));
    FINE(set(v, c, "motor_torque", torque));
    for (int i = 0; i < 20; i++) FINE(v->step(c, 0.02 * i, 0.02));
    FINE(get(v, c, "axle_load", load));
    CHECK(load[0] < before[0] && load[2] > before[2]);
    CHECK(fabs((load[0] + load[1] + load[2]) / (before[0] + before[1] + before[2]) - 1.0) < 1e-12);
    size_t size = 0;
    FINE(v->save(c, &saved));
    FINE(v->size(c, saved, &size));
    unsigned char *bytes = malloc(size);
    FINE(v->serialize(c, saved, bytes, size));
    FINE(v->step(c, 0.4, 0.02));
    FINE(v->deserialize(c, bytes, size, &taken));
    FINE(v->restore(c, taken));
    FINE(get(v, c, "axle_load", after));
    CHECK(memcmp(load, after, sizeof load) == 0);
    FINE(v->forget(c, &saved));
    FINE(v->forget(c, &taken));
    free(bytes);
    v->close(c);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        unsigned of = index_of(wrong[i].name);
        c = v->open(0, token, resources, 1, &messages);
        FINE(wrong[i].value[1] > 0.0 ? set(v, c, wrong[i].name, wrong[i].value)
                                     : v->set(c, &of, 1, wrong[i].value));
        REFUSED(wrong[i].text, start(v, c, 0.0));
        v->close(c);
    }
}

/* Damage the number at a place of a file, or the length, and seal it again. */
static void test_damage(const char *folder, const char *name, size_t at, double value, size_t cut,
                        const char *text) {
    char message[4096], path[4096], magic[8];
    void *bytes, *original;
    size_t size;
    uint32_t version;
    CHECK(resource_read(folder, name, &original, &size, message, sizeof message) == NULL);
    CHECK(resource_read(folder, name, &bytes, &size, message, sizeof message) == NULL);
    memcpy((char *)bytes + CHECKED_FILE_FRAME + 8 * at, &value, sizeof value);
    memcpy(magic, bytes, sizeof magic);
    memcpy(&version, (char *)bytes + sizeof magic, sizeof version);
    checked_file_frame(bytes, size - cut, magic, version);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    for (int damaged = 1; damaged >= 0; damaged--) {
        FILE *file = fopen(path, "wb");
        fwrite(damaged ? bytes : original, 1, damaged ? size - cut : size, file);
        fclose(file);
        must_say = damaged ? text : "";
        void *c = fmi_of(2)->open(0, token, resources, 1, &messages);
        CHECK((c == NULL) == damaged);
        if (c != NULL) fmi_of(2)->close(c);
    }
    free(bytes);
    free(original);
}

int main(int count, char **arguments) {
    if (count != 5) return 2;
    resources = arguments[1];
    token = arguments[2];
    kind = model_of(arguments[3]);
    for (int version = 2; version <= 3; version++) {
        if (kind->is_vehicle) test_axles(fmi_of(version));
        else {
            test_steps(fmi_of(version));
            test_exchange(fmi_of(version));
        }
    }
    static const struct {
        size_t at;
        double value;
        size_t cut;
        const char *text;
    } values[] = {{0, 0.0, 0, "number of wheels"}, {0, 33.0, 0, "number of wheels"},
                  {1, 2.0, 0, "number of values"}, {2, 1e9, 0, "out of range"}, /* a radius */
                  {2, 0.5, 8, "number of values"}, {2, 0.5, 1, "within a number"}},
      rails[] = {{0, -1.0, 0, "cleaning"},        {3, 1000.0, 0, "power of two"},
                 {4, 0.0, 0, "number of points"}, {4, 1.5, 0, "not whole"},
                 {5, 6.0, 0, "not increasing"},   {7, -0.5, 0, "value of a profile"}};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        test_damage(arguments[4], "start_values.bin", values[i].at, values[i].value, values[i].cut,
                    values[i].text);
    for (size_t i = 0; kind->is_vehicle && i < sizeof rails / sizeof *rails; i++)
        test_damage(arguments[4], "rails.bin", rails[i].at, rails[i].value, 0, rails[i].text);
    if (kind->is_vehicle)
        test_damage(arguments[4], "start_values.bin", place_of("axles"), 2.0, 0, "number of axles");
    return verdict();
}
