/* What the C hosts of the tests share: an FMU's library loaded at run time, memory that is counted, tables of numbers.
   Includes the FMI headers that the FMU carries among its sources. */
#ifndef HOST_H
#define HOST_H

#include "fmi2FunctionTypes.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
typedef HMODULE Library;
static Library library_open(const char *path) { return LoadLibraryA(path); }
static void *library_find(Library library, const char *name) { return (void *)GetProcAddress(library, name); }
static void library_close(Library library) { FreeLibrary(library); }
#else
#include <dlfcn.h>
typedef void *Library;
static Library library_open(const char *path) {
    Library library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) fprintf(stderr, "%s\n", dlerror());
    return library;
}
static void *library_find(Library library, const char *name) { return dlsym(library, name); }
static void library_close(Library library) { dlclose(library); }
#endif

#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            exit(1); \
        } \
    } while (0)

#define FUNCTIONS(X) \
    X(GetTypesPlatform) X(GetVersion) X(SetDebugLogging) X(Instantiate) X(FreeInstance) X(SetupExperiment) \
    X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate) X(Reset) X(GetReal) X(GetInteger) X(GetBoolean) \
    X(GetString) X(SetReal) X(SetInteger) X(SetBoolean) X(SetString) X(GetFMUstate) X(SetFMUstate) X(FreeFMUstate) \
    X(SerializedFMUstateSize) X(SerializeFMUstate) X(DeSerializeFMUstate) X(GetDirectionalDerivative) \
    X(SetRealInputDerivatives) X(GetRealOutputDerivatives) X(DoStep) X(CancelStep) X(GetStatus) X(GetRealStatus) \
    X(GetIntegerStatus) X(GetBooleanStatus) X(GetStringStatus)

typedef struct {
    Library library;
    const char *guid, *resources;
#define MEMBER(name) fmi2##name##TYPE *name;
    FUNCTIONS(MEMBER)
#undef MEMBER
} Fmu;

static Fmu fmu_open(const char *path, const char *guid, const char *resources) {
    Fmu fmu = {0};
    fmu.library = library_open(path);
    fmu.guid = guid;
    fmu.resources = resources;
    CHECK(fmu.library);
#define FIND(name) \
    *(void **)&fmu.name = library_find(fmu.library, "fmi2" #name); \
    CHECK(fmu.name);
    FUNCTIONS(FIND)
#undef FIND
    return fmu;
}

/* ------------------------------------------------------------------------------------------------------- callbacks */

static long living; /* blocks that the FMU has taken and not yet given back; single-threaded hosts only */
static int messages[5];
static char last_message[4096];

static void *counted_allocate(size_t count, size_t size) { return living++, calloc(count, size); }

static void counted_free(void *block) {
    if (block) living--;
    free(block);
}

/* As most hosts do it: the message is a format. */
static void hear(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    va_list values;
    (void)environment;
    CHECK(instance && category && message && status <= fmi2Fatal);
    va_start(values, message);
    vsnprintf(last_message, sizeof last_message, message, values);
    va_end(values);
    messages[status]++;
}

static const fmi2CallbackFunctions callbacks = {hear, counted_allocate, counted_free, NULL, NULL};

/* An instance after initialization, its first inputs given. */
static fmi2Component begin(const Fmu *fmu, const fmi2CallbackFunctions *functions, const fmi2ValueReference *inputs,
                           size_t n_inputs, const double *values) {
    fmi2Component c = fmu->Instantiate("host", fmi2CoSimulation, fmu->guid, fmu->resources, functions, 0, 0);
    CHECK(c);
    CHECK(fmu->SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) == fmi2OK);
    CHECK(fmu->EnterInitializationMode(c) == fmi2OK);
    CHECK(fmu->SetReal(c, inputs, n_inputs, values) == fmi2OK);
    CHECK(fmu->ExitInitializationMode(c) == fmi2OK);
    return c;
}

/* ---------------------------------------------------------------------------------------------------------- tables */

enum { MOST_COLUMNS = 64 };

typedef struct {
    size_t rows, columns;
    double *values; /* row by row; the first column is time */
} Table;

/* A CSV file: one line of names, then numbers. */
static Table table_read(const char *path) {
    static char line[1 << 16];
    Table table = {0, 0, NULL};
    FILE *file = fopen(path, "r");
    CHECK(file && fgets(line, sizeof line, file));
    while (fgets(line, sizeof line, file)) {
        char *at = line, *end;
        size_t columns = 0;
        table.values = realloc(table.values, (table.rows + 1) * MOST_COLUMNS * sizeof(double));
        CHECK(table.values);
        for (; columns < MOST_COLUMNS; columns++) {
            table.values[table.rows * MOST_COLUMNS + columns] = strtod(at, &end);
            if (end == at) break;
            at = *end == ',' ? end + 1 : end;
        }
        CHECK(table.rows == 0 || columns == table.columns);
        table.columns = columns;
        table.rows++;
    }
    fclose(file);
    return table;
}

static const double *table_row(const Table *table, size_t row) { return table->values + row * MOST_COLUMNS; }

/* Value references from a text such as "0,1,2". */
static size_t references_read(const char *text, fmi2ValueReference references[MOST_COLUMNS]) {
    size_t count = 0;
    while (*text && count < MOST_COLUMNS) {
        char *end;
        references[count++] = (fmi2ValueReference)strtoul(text, &end, 10);
        text = *end == ',' ? end + 1 : end;
    }
    return count;
}

#endif
