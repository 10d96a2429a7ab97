/* Run under the thread sanitizer: instances of both versions of FMI made, run and freed, and many
 * drivetrains stepped under one table, by several threads at once. What each gets is what one
 * thread alone gets, to the last bit.
 *
 *     test_threads THREADS REPETITIONS RESOURCES TOKEN
 *
 * RESOURCES is a URI, that of a wheelset. */
#include <pthread.h>

#include "checks.h"
#include "component.h"
#include "drivetrain.h"
#include "fmi.h"

enum { MAX_THREADS = 16, STEPS = 40, TRAINS = 20 };

/* All that a thread finds out. */
typedef struct {
    double speed2[STEPS], speed3[STEPS], ratio[TRAINS], slope[TRAINS];
    drivetrain_state trains[TRAINS];
    int faults, messages;
} findings;

static const char *resources, *token;
static unsigned torque, speed; /* value references */
static creep_table table;      /* shared, and not changed */
static force_element_parameters contact;

static double torque_at(int step) { return 2.4e4 + 1e3 * (step % 7); }

static void run(const fmi *v, findings *found, double *speeds) {
    found->faults += v->open(0, "?", resources, 1, &found->messages) != NULL;
    void *c = v->open(0, token, resources, 1, &found->messages);
    found->faults += start(v, c, 0.0) > RESULT_OK;
    found->faults += v->step(c, 1.0, 1e-2) != RESULT_ERROR;
    for (int i = 0; i < STEPS; i++) {
        double value = torque_at(i);
        void *saved = NULL;
        found->faults += v->set(c, &torque, 1, &value) != RESULT_OK;
        found->faults += v->step(c, 1e-2 * i, 1e-2) != RESULT_OK;
        found->faults += v->get(c, &speed, 1, &speeds[i]) != RESULT_OK;
        found->faults += v->save(c, &saved) != RESULT_OK;
        found->faults += v->forget(c, &saved) != RESULT_OK;
    }
    v->close(c);
}

static void run_many(findings *found) {
    static const drivetrain_parameters train = {.body = SOME_BODY,
                                                .axle_stiffness = 6e6,
                                                .axle_damping = 1e3,
                                                .drive_share = 0.6,
                                                .motor_lag = 0.01};
    drivetrain_member members[TRAINS];
    drivetrain_input in[TRAINS];
    double tried[TRAINS] = {0.0}, x[TRAINS], k[TRAINS], layer = 0.0;
    unsigned char failed[TRAINS] = {0};
    for (int i = 0; i < TRAINS; i++) {
        members[i] =
            (drivetrain_member){.table = &table, .contact = &contact, .drivetrain = &train};
        in[i] = (drivetrain_input){.commanded_torque = 2e4 + 500.0 * i,
                                   .load_left = 1.1e5,
                                   .load_right = 1e5,
                                   .friction_left = 1.0,
                                   .friction_right = 0.9,
                                   .slope = 1.0};
        found->trains[i] =
            (drivetrain_state){.speed = 10.0, .omega_left = 20.0, .omega_right = 20.0};
        x[i] = 0.1 * i;
        k[i] = 0.3;
    }
    drivetrains_prepare(members, TRAINS);
    drivetrains_advance(members, TRAINS, 1, NULL, in, found->trains, 0.0, 0.02, 1e-4, tried,
                        failed);
    for (int i = 0; i < TRAINS; i++) found->faults += failed[i];
    creep_table_evaluate_many(&table, TRAINS, x, k, 1, &layer, 0, found->ratio, found->slope);
}

static int repetitions;

static void *run_all(void *argument) {
    findings *found = argument;
    for (int i = 0; i < repetitions; i++) {
        run_many(found);
        run(fmi_of(2), found, found->speed2);
        run(fmi_of(3), found, found->speed3);
    }
    return NULL;
}

int main(int count, char **arguments) {
    static findings found[MAX_THREADS + 1];
    pthread_t threads[MAX_THREADS];
    if (count != 5) return 2;
    int n = atoi(arguments[1]);
    repetitions = atoi(arguments[2]);
    resources = arguments[3];
    token = arguments[4];
    const model *m = model_of("wheelset");
    for (unsigned i = 0; i < m->count; i++) {
        if (strcmp(m->variables[i].name, "drive_torque") == 0) torque = i;
        if (strcmp(m->variables[i].name, "speed") == 0) speed = i;
    }
    if (n < 1 || n > MAX_THREADS) return 2;
    table = (creep_table){.k_max = 2.0}; /* that of the line contact */
    contact = (force_element_parameters)SOME_CONTACT;
    /* The threads first: nothing may be made ready for them by the one that runs alone. */
    for (int i = 0; i < n; i++) CHECK(pthread_create(&threads[i], NULL, run_all, &found[i]) == 0);
    for (int i = 0; i < n; i++) CHECK(pthread_join(threads[i], NULL) == 0);
    run_all(&found[n]);
    CHECK(found[n].faults == 0 && found[n].messages == 4 * repetitions);
    CHECK(found[n].speed2[STEPS - 1] != 0.0);
    CHECK(memcmp(found[n].speed2, found[n].speed3, sizeof found[n].speed2) == 0);
    for (int i = 0; i < n; i++) CHECK(memcmp(&found[i], &found[n], sizeof found[i]) == 0);
    return verdict();
}
