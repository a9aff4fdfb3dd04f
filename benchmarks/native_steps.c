/* Full steps of an FMU from C: set the inputs, step 1 s, get all outputs.

   native_steps LIBRARY GUID STEPS VARY INPUTS OUTPUTS   (value references separated by commas)
   prints: seconds to instantiate and initialise (best of 7 lives), seconds for all steps (every hundred steps in the
   life that was fastest in them: other programs that run meanwhile do not count) */
#define _POSIX_C_SOURCE 199309L
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"

enum { LIVES = 7, MOST = 256, BLOCK = 100 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void logger(void *e, const char *name, fmi2Status status, const char *category, const char *message, ...) {
    (void)e, (void)category;
    if (status > fmi2Warning) fprintf(stderr, "%s: %s\n", name, message);
}

static size_t references(char *text, fmi2ValueReference *found) {
    size_t n = 0;
    for (char *word = strtok(text, ","); word && n < MOST; word = strtok(NULL, ",")) found[n++] = (unsigned)atoi(word);
    return n;
}

#define LOAD(name) name##TYPE *const name##_ = (name##TYPE *)dlsym(library, #name)

int main(int argc, char **argv) {
    if (argc != 7) return 2;
    void *library = dlopen(argv[1], RTLD_NOW);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 2;
    LOAD(fmi2Instantiate);
    LOAD(fmi2SetupExperiment);
    LOAD(fmi2EnterInitializationMode);
    LOAD(fmi2ExitInitializationMode);
    LOAD(fmi2SetReal);
    LOAD(fmi2GetReal);
    LOAD(fmi2DoStep);
    LOAD(fmi2FreeInstance);
    const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    const int steps = atoi(argv[3]), vary = atoi(argv[4]);
    fmi2ValueReference inputs[MOST], outputs[MOST];
    const size_t n_in = references(argv[5], inputs), n_out = references(argv[6], outputs);
    const int blocks = (steps + BLOCK - 1) / BLOCK;
    double *const fastest = malloc((size_t)blocks * sizeof(double));
    double start = 1e9, stepping = 0.0, y[MOST];
    for (int block = 0; block < blocks; block++) fastest[block] = 1e9;
    for (int life = 0; life < LIVES; life++) {
        double u[4] = {300.0, 150.0, 293.15, 2.0};
        const double begin = now();
        fmi2Component c = fmi2Instantiate_("a", fmi2CoSimulation, argv[2], "", &callbacks, fmi2False, fmi2False);
        if (!c || fmi2SetupExperiment_(c, fmi2False, 0, 0, fmi2False, 0) || fmi2EnterInitializationMode_(c) ||
            fmi2SetReal_(c, inputs, n_in, u) || fmi2ExitInitializationMode_(c))
            return 3;
        const double ready = now();
        double last = ready;
        for (int i = 0; i < steps; i++) {
            if (vary) u[0] = 300.0 + 100.0 * sin(0.01 * i), u[1] = 150.0 + 50.0 * cos(0.013 * i);
            if (fmi2SetReal_(c, inputs, n_in, u) || fmi2DoStep_(c, i, 1.0, fmi2True) ||
                fmi2GetReal_(c, outputs, n_out, y))
                return 4;
            if ((i + 1) % BLOCK == 0 || i + 1 == steps) {
                const double time = now();
                fastest[i / BLOCK] = fmin(fastest[i / BLOCK], time - last);
                last = time;
            }
        }
        start = fmin(start, ready - begin);
        fmi2FreeInstance_(c);
    }
    for (int block = 0; block < blocks; block++) stepping += fastest[block];
    free(fastest);
    printf("%.9f %.9f\n", start, stepping);
    return 0;
}
