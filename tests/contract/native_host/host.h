/* What the C hosts of FMI 2.0 share: an FMU's functions, memory that is counted. Includes the FMI headers that the FMU
   carries among its sources. */
#ifndef HOST_H
#define HOST_H

#include "common.h"
#include "fmi2FunctionTypes.h"

#include <stdarg.h>

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

#endif
