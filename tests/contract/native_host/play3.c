/* Play a table of inputs with an FMU of FMI 3.0, held from row to row, and print the outputs at the end of every row.
   Half-way the state goes through bytes into a second instance, which plays the rest.
   play3 LIBRARY TOKEN RESOURCES INPUTS REALS IN.csv; INPUTS and REALS are value references. */
#include "common.h"

#include "fmi3FunctionTypes.h"

#define FUNCTIONS(X) \
    X(GetVersion) X(InstantiateCoSimulation) X(InstantiateModelExchange) X(FreeInstance) X(EnterInitializationMode) \
    X(ExitInitializationMode) X(Terminate) X(Reset) X(GetFloat64) X(SetFloat64) X(GetInt32) X(GetFMUState) \
    X(SetFMUState) X(FreeFMUState) X(SerializedFMUStateSize) X(SerializeFMUState) X(DeserializeFMUState) X(DoStep) \
    X(EnterEventMode)

static struct {
#define MEMBER(name) fmi3##name##TYPE *name;
    FUNCTIONS(MEMBER)
} fmu;

static int errors;
static fmi3ValueReference inputs[MOST_COLUMNS], reals[MOST_COLUMNS];
static size_t n_inputs, n_reals;
static Table in;

static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    CHECK(environment == &errors && category && message);
    errors += status == fmi3Error;
}

static fmi3Instance begin(const char *token) {
    fmi3Instance c = fmu.InstantiateCoSimulation("host", token, NULL, 0, 0, 0, 0, NULL, 0, &errors, hear, NULL);
    CHECK(c);
    CHECK(fmu.EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0) == fmi3OK);
    CHECK(fmu.SetFloat64(c, inputs, n_inputs, table_row(&in, 0) + 1, n_inputs) == fmi3OK);
    CHECK(fmu.ExitInitializationMode(c) == fmi3OK);
    return c;
}

static void play(fmi3Instance c, size_t first, size_t last) {
    double values[MOST_COLUMNS], reached;
    fmi3Boolean event, terminate, early;
    for (size_t row = first; row < last; row++) {
        const double time = table_row(&in, row)[0], next = table_row(&in, row + 1)[0];
        CHECK(fmu.SetFloat64(c, inputs, n_inputs, table_row(&in, row) + 1, n_inputs) == fmi3OK);
        CHECK(fmu.DoStep(c, time, next - time, 1, &event, &terminate, &early, &reached) == fmi3OK);
        CHECK(!event && !terminate && !early && reached == next);
        CHECK(fmu.GetFloat64(c, reals, n_reals, values, n_reals) == fmi3OK);
        for (size_t i = 0; i < n_reals; i++) printf("%.17g%c", values[i], i + 1 < n_reals ? ',' : '\n');
    }
}

static fmi3Instance copy_through_bytes(fmi3Instance c, const char *token) {
    fmi3Instance other = begin(token);
    fmi3FMUState state = NULL;
    fmi3Byte *bytes;
    size_t size;
    CHECK(fmu.GetFMUState(c, &state) == fmi3OK && fmu.SerializedFMUStateSize(c, state, &size) == fmi3OK);
    bytes = malloc(size);
    CHECK(bytes && fmu.SerializeFMUState(c, state, bytes, size) == fmi3OK);
    CHECK(fmu.FreeFMUState(c, &state) == fmi3OK && !state);
    CHECK(fmu.DeserializeFMUState(other, bytes, size, &state) == fmi3OK && fmu.SetFMUState(other, state) == fmi3OK);
    CHECK(fmu.FreeFMUState(other, &state) == fmi3OK);
    free(bytes);
    return other;
}

static void refusals(fmi3Instance c, const char *token) {
    double value;
    fmi3Int32 integer;
    fmi3Boolean event, terminate, early;
    const int before = errors;
    CHECK(!fmu.InstantiateCoSimulation("host", "wrong", NULL, 0, 0, 0, 0, NULL, 0, &errors, hear, NULL));
    CHECK(!fmu.InstantiateCoSimulation("host", token, NULL, 0, 0, 1, 0, NULL, 0, &errors, hear, NULL));
    CHECK(!fmu.InstantiateCoSimulation("host", token, NULL, 0, 0, 0, 0, inputs, 1, &errors, hear, NULL));
    CHECK(!fmu.InstantiateModelExchange("host", token, NULL, 0, 0, &errors, hear));
    CHECK(fmu.GetFloat64(c, inputs, 1, &value, 2) == fmi3Error && fmu.SetFloat64(c, reals, 1, &value, 1) == fmi3Error);
    CHECK(fmu.GetFloat64(c, NULL, 1, &value, 1) == fmi3Error && fmu.GetInt32(c, inputs, 1, &integer, 1) == fmi3Error);
    CHECK(fmu.EnterEventMode(c) == fmi3Error);
    CHECK(fmu.DoStep(c, 600.0, 1.0, 1, &event, &terminate, &early, NULL) == fmi3Error);
    CHECK(errors == before + 10);
    CHECK(fmu.DoStep(c, 17.0, 1.0, 1, &event, &terminate, &early, &value) == fmi3Discard);
    CHECK(fmu.GetFloat64(NULL, inputs, 1, &value, 1) == fmi3Error && fmu.EnterEventMode(NULL) == fmi3Error);
    CHECK(fmu.Terminate(c) == fmi3OK && fmu.Reset(c) == fmi3OK && fmu.ExitInitializationMode(c) == fmi3Error);
}

int main(int count, char **given) {
    Library library;
    fmi3Instance c, other;
    size_t half;
    CHECK(count == 7);
    library = library_open(given[1]);
    CHECK(library);
#define FIND(name) \
    *(void **)&fmu.name = library_find(library, "fmi3" #name); \
    CHECK(fmu.name);
    FUNCTIONS(FIND)
    CHECK(!strcmp(fmu.GetVersion(), "3.0"));
    n_inputs = references_read(given[4], inputs);
    n_reals = references_read(given[5], reals);
    in = table_read(given[6]);
    CHECK(in.columns == n_inputs + 1 && in.rows > 2);
    half = in.rows / 2;
    c = begin(given[2]);
    play(c, 0, half);
    other = copy_through_bytes(c, given[2]);
    fmu.FreeInstance(c);
    play(other, half, in.rows - 1);
    refusals(other, given[2]);
    fmu.FreeInstance(other);
    fmu.FreeInstance(NULL);
    free(in.values);
    library_close(library);
    return 0;
}
