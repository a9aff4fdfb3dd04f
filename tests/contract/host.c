/* A host that is not Python: three simulations of an FMU after each other, each ended by a step that must be discarded.
   host LIBRARY GUID RESOURCES_URI OUTPUT_REFERENCE; prints the output after 60 steps of 1 s. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished, *environment;
} Callbacks;

static void show(void *environment, const char *instance, int status, const char *category, const char *format, ...) {
    va_list values;
    va_start(values, format);
    fprintf(stderr, "[%d] ", status);
    vfprintf(stderr, format, values);
    fputc('\n', stderr);
    va_end(values);
}

int main(int count, char **given) {
    void *library = count == 5 ? dlopen(given[1], RTLD_NOW) : NULL;
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 3;
    void *(*instantiate)(const char *, int, const char *, const char *, Callbacks *, int, int) = dlsym(library, "fmi2Instantiate");
    int (*setup)(void *, int, double, double, int, double) = dlsym(library, "fmi2SetupExperiment");
    int (*enter)(void *) = dlsym(library, "fmi2EnterInitializationMode");
    int (*leave)(void *) = dlsym(library, "fmi2ExitInitializationMode");
    int (*step)(void *, double, double, int) = dlsym(library, "fmi2DoStep");
    int (*get)(void *, const unsigned *, size_t, double *) = dlsym(library, "fmi2GetReal");
    int (*set)(void *, const unsigned *, size_t, const double *) = dlsym(library, "fmi2SetReal");
    int (*terminate)(void *) = dlsym(library, "fmi2Terminate");
    void (*release)(void *) = dlsym(library, "fmi2FreeInstance");
    Callbacks callbacks = {show, calloc, free, NULL, NULL};
    unsigned inputs[4] = {0, 1, 2, 3}, output = (unsigned)atoi(given[4]);
    for (int run = 0; run < 3; run++) {
        double values[4] = {300.0, 150.0, 293.15, 2.0}, result = 0.0;
        void *instance = instantiate("host", 1, given[2], given[3], &callbacks, 0, 1);
        if (!instance) return 4;
        if (setup(instance, 0, 0.0, 0.0, 0, 0.0) || enter(instance) || set(instance, inputs, 4, values) || leave(instance)) return 5;
        for (int i = 0; i < 60; i++)
            if (step(instance, i, 1.0, 1)) return 6;
        if (get(instance, &output, 1, &result)) return 7;
        printf("%.17g\n", result);
        values[2] = 20.0;
        set(instance, inputs, 4, values);
        if (step(instance, 60.0, 1.0, 1) != 2) return 8;
        terminate(instance);
        release(instance);
    }
    return 0;
}
