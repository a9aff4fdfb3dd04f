/* What an FMU does in the long run, in a host without Python.

   endurance LIBRARY GUID RESOURCES INPUTS REALS cycles COUNT
       create, initialise, step, save, free, again and again; fails if memory grows
   endurance ... threads INSTANCES THREADS
       instances stepped in turns by several threads; fails if one differs from the same simulation alone
   endurance ... steps COUNT SPEED_1,SPEED_2,... TORQUE_1,TORQUE_2,... SECONDS
       steps of 0.1 s; the load changes after SECONDS, over and over; prints REALS at each change of the last round */
#include "host.h"

#include <pthread.h>
#include <unistd.h>

enum { STEPS = 50, MOST_INSTANCES = 256 };

static Fmu fmu;
static fmi2ValueReference inputs[MOST_COLUMNS], reals[MOST_COLUMNS];
static size_t n_inputs, n_reals;
static const fmi2CallbackFunctions silent = {NULL, calloc, free, NULL, NULL}; /* usable from many threads */

static void load(double *values, double speed, double torque) {
    values[0] = speed, values[1] = torque, values[2] = 293.15, values[3] = 2.0;
}

/* ---------------------------------------------------------------------------------------------------------- cycles */

static long resident_bytes(void) {
    long total = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    CHECK(file && fscanf(file, "%ld %ld", &total, &resident) == 2);
    fclose(file);
    return resident * sysconf(_SC_PAGESIZE);
}

static void one_life(void) {
    double values[4], results[MOST_COLUMNS];
    fmi2FMUstate state = NULL;
    fmi2Component c;
    load(values, 300.0, 150.0);
    c = begin(&fmu, &callbacks, inputs, 4, values);
    CHECK(fmu.GetFMUstate(c, &state) == fmi2OK);
    CHECK(fmu.DoStep(c, 0.0, 1.0, 1) == fmi2OK && fmu.GetReal(c, reals, n_reals, results) == fmi2OK);
    CHECK(fmu.FreeFMUstate(c, &state) == fmi2OK && fmu.Terminate(c) == fmi2OK);
    fmu.FreeInstance(c);
}

static void cycles(long count) {
    long before;
    for (int i = 0; i < 1000; i++) one_life(); /* whatever the C library and the kernel's counters keep for themselves */
    resident_bytes();
    before = resident_bytes();
    for (long i = 0; i < count; i++) one_life();
    printf("%ld\n", resident_bytes() - before);
    CHECK(living == 0);
}

/* --------------------------------------------------------------------------------------------------------- threads */

typedef struct {
    int first, step_of_instances, instances;
    double (*results)[MOST_COLUMNS];
} Share;

static void one_step(fmi2Component c, int instance, int step) {
    double values[4];
    load(values, 50.0 + 5.0 * instance + 5.0 * (step % 7), 20.0 + instance);
    CHECK(fmu.SetReal(c, inputs, 4, values) == fmi2OK && fmu.DoStep(c, step, 1.0, 1) == fmi2OK);
}

static fmi2Component fresh(int instance) {
    double values[4];
    load(values, 50.0 + 5.0 * instance, 20.0 + instance);
    return begin(&fmu, &silent, inputs, 4, values);
}

/* The instances of one thread, in turns. */
static void *work(void *argument) {
    const Share *share = argument;
    fmi2Component c[MOST_INSTANCES];
    for (int i = share->first; i < share->instances; i += share->step_of_instances) c[i] = fresh(i);
    for (int step = 0; step < STEPS; step++)
        for (int i = share->first; i < share->instances; i += share->step_of_instances) one_step(c[i], i, step);
    for (int i = share->first; i < share->instances; i += share->step_of_instances) {
        CHECK(fmu.GetReal(c[i], reals, n_reals, share->results[i]) == fmi2OK);
        fmu.FreeInstance(c[i]);
    }
    return NULL;
}

static void threads(int instances, int count) {
    static double together[MOST_INSTANCES][MOST_COLUMNS];
    pthread_t thread[64];
    Share share[64];
    CHECK(instances <= MOST_INSTANCES && count <= 64);
    for (int i = 0; i < count; i++) {
        share[i] = (Share){i, count, instances, together};
        CHECK(!pthread_create(&thread[i], NULL, work, &share[i]));
    }
    for (int i = 0; i < count; i++) CHECK(!pthread_join(thread[i], NULL));
    for (int i = 0; i < instances; i++) {
        double alone[MOST_COLUMNS];
        fmi2Component c = fresh(i);
        for (int step = 0; step < STEPS; step++) one_step(c, i, step);
        CHECK(fmu.GetReal(c, reals, n_reals, alone) == fmi2OK);
        CHECK(!memcmp(alone, together[i], n_reals * sizeof(double)));
        CHECK(i == 0 || memcmp(together[0], together[i], n_reals * sizeof(double))); /* the loads do differ */
        fmu.FreeInstance(c);
    }
}

/* ----------------------------------------------------------------------------------------------------------- steps */

static size_t numbers_read(const char *text, double numbers[MOST_COLUMNS]) {
    size_t count = 0;
    while (*text && count < MOST_COLUMNS) {
        char *end;
        numbers[count++] = strtod(text, &end);
        text = *end == ',' ? end + 1 : end;
    }
    return count;
}

static void steps(long count, const char *speeds, const char *torques, long seconds) {
    double speed[MOST_COLUMNS], torque[MOST_COLUMNS], values[4], results[MOST_COLUMNS];
    const long n_loads = (long)numbers_read(speeds, speed), held = 10 * seconds;
    fmi2Component c;
    CHECK(n_loads > 0 && numbers_read(torques, torque) == (size_t)n_loads);
    load(values, speed[0], torque[0]);
    c = begin(&fmu, &callbacks, inputs, 4, values);
    for (long i = 0; i < count; i++) {
        const long now = i / held % n_loads;
        load(values, speed[now], torque[now]);
        CHECK(fmu.SetReal(c, inputs, 4, values) == fmi2OK);
        CHECK(fmu.DoStep(c, 0.1 * i, 0.1, 1) == fmi2OK);
        if ((i + 1) % held || i + 1 <= count - held * n_loads) continue;
        CHECK(fmu.GetReal(c, reals, n_reals, results) == fmi2OK);
        for (size_t k = 0; k < n_reals; k++) printf("%.12g%c", results[k], k + 1 < n_reals ? ',' : '\n');
    }
    fmu.FreeInstance(c);
}

int main(int count, char **given) {
    CHECK(count >= 8);
    fmu = fmu_open(given[1], given[2], given[3]);
    n_inputs = references_read(given[4], inputs);
    n_reals = references_read(given[5], reals);
    CHECK(n_inputs == 4);
    if (!strcmp(given[6], "cycles")) cycles(atol(given[7]));
    else if (!strcmp(given[6], "threads") && count == 9) threads(atoi(given[7]), atoi(given[8]));
    else if (!strcmp(given[6], "steps") && count == 11) steps(atol(given[7]), given[8], given[9], atol(given[10]));
    else return 2;
    library_close(fmu.library);
    return 0;
}
