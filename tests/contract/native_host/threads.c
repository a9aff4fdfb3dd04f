/* Instances in threads of their own, each played from the same table at the same time: all must end with the same bits.
   threads LIBRARY GUID RESOURCES INPUTS REALS IN.csv */
#include "host.h"

#include <pthread.h>

enum { THREADS = 4 };

static Fmu fmu;
static fmi2ValueReference inputs[MOST_COLUMNS], reals[MOST_COLUMNS];
static size_t n_inputs, n_reals;
static Table in;
static const fmi2CallbackFunctions silent = {NULL, calloc, free, NULL, NULL};

static void *play(void *results) {
    fmi2Component c = begin(&fmu, &silent, inputs, n_inputs, table_row(&in, 0) + 1);
    fmi2FMUstate state = NULL;
    for (size_t row = 0; row + 1 < in.rows; row++) {
        const double time = table_row(&in, row)[0];
        CHECK(fmu.SetReal(c, inputs, n_inputs, table_row(&in, row) + 1) == fmi2OK);
        CHECK(fmu.GetFMUstate(c, &state) == fmi2OK && fmu.SetFMUstate(c, state) == fmi2OK);
        CHECK(fmu.DoStep(c, time, table_row(&in, row + 1)[0] - time, 1) == fmi2OK);
        CHECK(fmu.GetReal(c, reals, n_reals, results) == fmi2OK);
    }
    CHECK(fmu.FreeFMUstate(c, &state) == fmi2OK);
    fmu.FreeInstance(c);
    return NULL;
}

int main(int count, char **given) {
    static double results[THREADS][MOST_COLUMNS];
    pthread_t threads[THREADS];
    CHECK(count == 7);
    fmu = fmu_open(given[1], given[2], given[3]);
    n_inputs = references_read(given[4], inputs);
    n_reals = references_read(given[5], reals);
    in = table_read(given[6]);
    for (int i = 0; i < THREADS; i++) CHECK(!pthread_create(&threads[i], NULL, play, results[i]));
    for (int i = 0; i < THREADS; i++) CHECK(!pthread_join(threads[i], NULL));
    for (int i = 1; i < THREADS; i++) CHECK(!memcmp(results[0], results[i], sizeof results[0]));
    for (size_t i = 0; i < n_reals; i++) printf("%.17g%c", results[0][i], i + 1 < n_reals ? ',' : '\n');
    free(in.values);
    library_close(fmu.library);
    return 0;
}
