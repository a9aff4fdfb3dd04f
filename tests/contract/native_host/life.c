/* The whole life of an FMU in a host without Python, checked against given numbers: its own reference run, saved states,
   derivatives, refusals, and memory given back to the last block.

   life LIBRARY GUID RESOURCES INPUTS REALS FIXED BOOLEAN IN.csv OUT.csv
   INPUTS, REALS: value references of the columns of the two tables; FIXED, BOOLEAN: those of a start temperature and of
   in_domain. */
#include "host.h"

#include <math.h>

static Fmu fmu;
static fmi2ValueReference inputs[MOST_COLUMNS], reals[MOST_COLUMNS], fixed, boolean;
static size_t n_inputs, n_reals;
static Table in, out;

static int close_to(double value, double expected) {
    return fabs(value - expected) <= 1e-6 * fmax(1.0, fabs(expected));
}

static void compare(fmi2Component c, size_t row) {
    double values[MOST_COLUMNS];
    CHECK(fmu.GetReal(c, reals, n_reals, values) == fmi2OK);
    for (size_t i = 0; i < n_reals; i++)
        if (!close_to(values[i], table_row(&out, row)[i + 1])) {
            fprintf(stderr, "row %lu, value reference %u: %.12g instead of %.12g\n", (unsigned long)row, reals[i],
                    values[i], table_row(&out, row)[i + 1]);
            exit(1);
        }
}

/* Rows of the reference run. Inputs are held from their row to the next. */
static void play(fmi2Component c, size_t first, size_t last) {
    for (size_t row = first; row < last; row++) {
        const double time = table_row(&in, row)[0], next = table_row(&in, row + 1)[0];
        fmi2Real reached;
        CHECK(fmu.SetReal(c, inputs, n_inputs, table_row(&in, row) + 1) == fmi2OK);
        CHECK(fmu.DoStep(c, time, next - time, 1) == fmi2OK);
        CHECK(fmu.GetRealStatus(c, fmi2LastSuccessfulTime, &reached) == fmi2OK && fabs(reached - next) < 1e-9);
        compare(c, row + 1);
    }
}

static void reference_run(void) {
    fmi2Component c = begin(&fmu, &callbacks, inputs, n_inputs, table_row(&in, 0) + 1);
    fmi2Boolean inside = 0;
    compare(c, 0);
    play(c, 0, in.rows - 1);
    CHECK(fmu.GetBoolean(c, &boolean, 1, &inside) == fmi2OK && inside == fmi2True);
    CHECK(fmu.Terminate(c) == fmi2OK);
    CHECK(fmu.DoStep(c, table_row(&in, in.rows - 1)[0], 1.0, 1) == fmi2Error);
    CHECK(fmu.Reset(c) == fmi2OK); /* and once more in the same instance */
    CHECK(fmu.SetupExperiment(c, 1, 1e-4, 0.0, 1, 600.0) == fmi2OK);
    CHECK(fmu.EnterInitializationMode(c) == fmi2OK);
    CHECK(fmu.SetReal(c, inputs, n_inputs, table_row(&in, 0) + 1) == fmi2OK);
    compare(c, 0); /* outputs are valid in initialization mode */
    CHECK(fmu.ExitInitializationMode(c) == fmi2OK);
    play(c, 0, in.rows / 2);
    fmu.FreeInstance(c);
}

static void saved_states(void) {
    const size_t half = in.rows / 2, end = in.rows - 1;
    fmi2Component c = begin(&fmu, &callbacks, inputs, n_inputs, table_row(&in, 0) + 1), other;
    fmi2FMUstate state = NULL, again = NULL, copy = NULL;
    size_t size = 0;
    char *bytes, *later;
    play(c, 0, half);
    CHECK(fmu.GetFMUstate(c, &state) == fmi2OK && state);
    CHECK(fmu.SerializedFMUstateSize(c, state, &size) == fmi2OK && size > 0);
    bytes = malloc(size);
    later = malloc(size + 1) ; /* one more, so that the second copy is not aligned */
    CHECK(bytes && later);
    CHECK(fmu.SerializeFMUstate(c, state, bytes, size) == fmi2OK);
    CHECK(fmu.SerializeFMUstate(c, state, bytes, size - 1) == fmi2Error);
    play(c, half, end);
    CHECK(fmu.GetFMUstate(c, &again) == fmi2OK);
    CHECK(fmu.SerializeFMUstate(c, again, later + 1, size) == fmi2OK && memcmp(bytes, later + 1, size) != 0);
    memcpy(bytes, later + 1, size); /* the state at the end, to be met again below */
    CHECK(fmu.SetFMUstate(c, state) == fmi2OK);
    play(c, half, end);
    CHECK(fmu.GetFMUstate(c, &again) == fmi2OK); /* into the room that there is */
    CHECK(fmu.SerializeFMUstate(c, again, later + 1, size) == fmi2OK && !memcmp(bytes, later + 1, size));

    other = begin(&fmu, &callbacks, inputs, n_inputs, table_row(&in, 0) + 1);
    CHECK(fmu.SetFMUstate(c, state) == fmi2OK);
    CHECK(fmu.SerializeFMUstate(c, state, later + 1, size) == fmi2OK);
    CHECK(fmu.DeSerializeFMUstate(other, later + 1, size, &copy) == fmi2OK);
    CHECK(fmu.SetFMUstate(other, copy) == fmi2OK);
    play(other, half, end);
    later[size / 2] ^= 1;
    CHECK(fmu.DeSerializeFMUstate(other, later + 1, size, &copy) == fmi2Error);
    CHECK(fmu.DeSerializeFMUstate(other, NULL, size, &copy) == fmi2Error);
    CHECK(fmu.DeSerializeFMUstate(other, later + 1, 3, &copy) == fmi2Error);
    CHECK(fmu.SetFMUstate(other, NULL) == fmi2Error);
    CHECK(fmu.FreeFMUstate(other, &copy) == fmi2OK && !copy);
    CHECK(fmu.FreeFMUstate(other, &copy) == fmi2OK); /* NULL: allowed */
    CHECK(fmu.FreeFMUstate(other, NULL) == fmi2OK);
    fmu.FreeInstance(other);
    CHECK(fmu.FreeFMUstate(c, &state) == fmi2OK && fmu.FreeFMUstate(c, &again) == fmi2OK);
    fmu.FreeInstance(c);
    free(bytes);
    free(later);
}

/* A directional derivative is what a small change of the input does. */
static void derivatives(void) {
    const double h = 1e-4;
    double ahead[MOST_COLUMNS], behind[MOST_COLUMNS], slopes[MOST_COLUMNS], moved[MOST_COLUMNS];
    const size_t row = in.rows / 2;
    fmi2Component c = begin(&fmu, &callbacks, inputs, n_inputs, table_row(&in, 0) + 1);
    play(c, 0, row);
    memcpy(moved, table_row(&in, row) + 1, n_inputs * sizeof(double));
    for (size_t k = 0; k < n_inputs; k++) {
        const double one = 1.0, value = moved[k], step = h * fmax(1.0, fabs(value));
        CHECK(fmu.SetReal(c, inputs, n_inputs, moved) == fmi2OK);
        CHECK(fmu.GetDirectionalDerivative(c, reals, n_reals, &inputs[k], 1, &one, slopes) == fmi2OK);
        moved[k] = value + step;
        CHECK(fmu.SetReal(c, inputs, n_inputs, moved) == fmi2OK && fmu.GetReal(c, reals, n_reals, ahead) == fmi2OK);
        moved[k] = value - step;
        CHECK(fmu.SetReal(c, inputs, n_inputs, moved) == fmi2OK && fmu.GetReal(c, reals, n_reals, behind) == fmi2OK);
        moved[k] = value;
        for (size_t i = 0; i < n_reals; i++)
            CHECK(fabs(slopes[i] - (ahead[i] - behind[i]) / (2.0 * step)) <= 1e-5 * fmax(1.0, fabs(slopes[i])));
    }
    fmu.FreeInstance(c);
}

/* What is not allowed is refused, told, and changes nothing. */
static void refusals(void) {
    const double hot = 350.0, bad = NAN, rate = 1.0;
    const fmi2ValueReference nobody = 1000000;
    const fmi2Integer first = 1, second = 2;
    const fmi2String unknown = "logNothing";
    fmi2CallbackFunctions plain = {NULL, NULL, NULL, NULL, NULL};
    fmi2Component c;
    fmi2Integer integer;
    fmi2Boolean flag;
    fmi2String text;
    fmi2Status status;
    double value, before[MOST_COLUMNS], after[MOST_COLUMNS];

    CHECK(!fmu.Instantiate("host", fmi2CoSimulation, "{wrong}", fmu.resources, &callbacks, 0, 1));
    CHECK(strstr(last_message, "GUID"));
    CHECK(!fmu.Instantiate("host", fmi2CoSimulation, NULL, NULL, &callbacks, 0, 1));
    CHECK(!fmu.Instantiate("host", fmi2ModelExchange, fmu.guid, NULL, &callbacks, 0, 1));
    CHECK(!fmu.Instantiate(NULL, fmi2CoSimulation, fmu.guid, NULL, &callbacks, 0, 1));
    CHECK(!fmu.Instantiate("", fmi2CoSimulation, fmu.guid, NULL, &callbacks, 0, 1));
    CHECK(!fmu.Instantiate("host", fmi2CoSimulation, fmu.guid, NULL, NULL, 0, 1));
    c = fmu.Instantiate("host", fmi2CoSimulation, fmu.guid, NULL, &plain, 0, 1); /* no callbacks, no resources: works */
    CHECK(c && fmu.DoStep(c, 0.0, 1.0, 1) == fmi2Error);
    fmu.FreeInstance(c);
    fmu.FreeInstance(NULL);

    c = fmu.Instantiate("50 %s %n", fmi2CoSimulation, fmu.guid, "", &callbacks, 0, 1);
    CHECK(c);
    CHECK(fmu.DoStep(c, 0.0, 1.0, 1) == fmi2Error && fmu.ExitInitializationMode(c) == fmi2Error);
    CHECK(fmu.EnterInitializationMode(c) == fmi2Error && fmu.Terminate(c) == fmi2Error);
    CHECK(fmu.GetReal(c, reals, n_reals, after) == fmi2Error);
    CHECK(fmu.SetDebugLogging(c, 1, 1, &unknown) == fmi2Error && fmu.SetDebugLogging(c, 1, 1, NULL) == fmi2Error);
    CHECK(fmu.SetupExperiment(c, 0, 0.0, bad, 0, 0.0) == fmi2Error);
    fmu.FreeInstance(c);

    c = begin(&fmu, &callbacks, inputs, n_inputs, table_row(&in, 0) + 1);
    play(c, 0, 2);
    CHECK(fmu.GetReal(c, reals, n_reals, before) == fmi2OK);
    CHECK(fmu.SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) == fmi2Error);
    CHECK(fmu.EnterInitializationMode(c) == fmi2Error);
    CHECK(fmu.SetReal(c, &fixed, 1, &hot) == fmi2Error && fmu.SetReal(c, reals, 1, &hot) == fmi2Error);
    CHECK(fmu.SetReal(c, &nobody, 1, &hot) == fmi2Error && fmu.GetReal(c, &nobody, 1, &value) == fmi2Error);
    CHECK(fmu.SetReal(c, &boolean, 1, &hot) == fmi2Error && fmu.GetReal(c, &boolean, 1, &value) == fmi2Error);
    CHECK(fmu.GetReal(c, NULL, 1, &value) == fmi2Error && fmu.GetReal(c, inputs, 1, NULL) == fmi2Error);
    CHECK(fmu.SetReal(c, NULL, 1, &hot) == fmi2Error && fmu.SetReal(c, inputs, 1, NULL) == fmi2Error);
    CHECK(fmu.GetReal(c, NULL, 0, NULL) == fmi2OK && fmu.SetReal(c, NULL, 0, NULL) == fmi2OK);
    CHECK(fmu.GetInteger(c, inputs, 1, &integer) == fmi2Error && fmu.SetInteger(c, inputs, 1, &first) == fmi2Error);
    CHECK(fmu.GetBoolean(c, inputs, 1, &flag) == fmi2Error && fmu.SetBoolean(c, inputs, 1, &first) == fmi2Error);
    CHECK(fmu.GetString(c, inputs, 1, &text) == fmi2Error && fmu.SetString(c, inputs, 1, &unknown) == fmi2Error);
    CHECK(fmu.SetRealInputDerivatives(c, inputs, 1, &second, &rate) == fmi2Error);
    CHECK(fmu.SetRealInputDerivatives(c, reals, 1, &first, &rate) == fmi2Error);
    CHECK(fmu.SetRealInputDerivatives(c, inputs, 1, NULL, &rate) == fmi2Error);
    CHECK(fmu.GetRealOutputDerivatives(c, reals, 1, &first, &value) == fmi2Error);
    CHECK(fmu.GetDirectionalDerivative(c, inputs, 1, reals, 1, &rate, &value) == fmi2Error);
    CHECK(fmu.GetDirectionalDerivative(c, reals, 1, NULL, 1, &rate, &value) == fmi2Error);
    CHECK(fmu.CancelStep(c) == fmi2Error && fmu.GetStatus(c, fmi2DoStepStatus, NULL) == fmi2Error);
    CHECK(fmu.GetStringStatus(c, fmi2PendingStatus, &text) == fmi2Discard);
    CHECK(fmu.DoStep(c, table_row(&in, 2)[0], bad, 1) == fmi2Discard);
    CHECK(fmu.GetStatus(c, fmi2DoStepStatus, &status) == fmi2OK && status == fmi2Discard);
    CHECK(fmu.SetReal(c, inputs, 1, &bad) == fmi2OK && fmu.DoStep(c, table_row(&in, 2)[0], 1.0, 1) == fmi2Discard);
    CHECK(strstr(last_message, "finite"));
    CHECK(fmu.GetReal(c, reals, n_reals, after) == fmi2Warning && isnan(after[0]));
    CHECK(fmu.SetReal(c, inputs, n_inputs, table_row(&in, 1) + 1) == fmi2OK);
    CHECK(fmu.GetReal(c, reals, n_reals, after) == fmi2OK && !memcmp(before, after, n_reals * sizeof(double)));
    play(c, 2, 4);
    fmu.FreeInstance(c);

#define NULL_COMPONENT(call) CHECK(fmu.call == fmi2Error)
    NULL_COMPONENT(SetDebugLogging(NULL, 1, 0, NULL));
    NULL_COMPONENT(SetupExperiment(NULL, 0, 0.0, 0.0, 0, 0.0));
    NULL_COMPONENT(EnterInitializationMode(NULL));
    NULL_COMPONENT(ExitInitializationMode(NULL));
    NULL_COMPONENT(Terminate(NULL));
    NULL_COMPONENT(Reset(NULL));
    NULL_COMPONENT(GetReal(NULL, inputs, 1, &value));
    NULL_COMPONENT(SetReal(NULL, inputs, 1, &hot));
    NULL_COMPONENT(GetInteger(NULL, inputs, 1, &integer));
    NULL_COMPONENT(SetInteger(NULL, inputs, 1, &first));
    NULL_COMPONENT(GetBoolean(NULL, inputs, 1, &flag));
    NULL_COMPONENT(SetBoolean(NULL, inputs, 1, &first));
    NULL_COMPONENT(GetString(NULL, inputs, 1, &text));
    NULL_COMPONENT(SetString(NULL, inputs, 1, &unknown));
    NULL_COMPONENT(GetFMUstate(NULL, NULL));
    NULL_COMPONENT(SetFMUstate(NULL, NULL));
    NULL_COMPONENT(FreeFMUstate(NULL, NULL));
    NULL_COMPONENT(SerializedFMUstateSize(NULL, NULL, NULL));
    NULL_COMPONENT(SerializeFMUstate(NULL, NULL, NULL, 0));
    NULL_COMPONENT(DeSerializeFMUstate(NULL, NULL, 0, NULL));
    NULL_COMPONENT(GetDirectionalDerivative(NULL, reals, 1, inputs, 1, &rate, &value));
    NULL_COMPONENT(SetRealInputDerivatives(NULL, inputs, 1, &first, &rate));
    NULL_COMPONENT(GetRealOutputDerivatives(NULL, reals, 1, &first, &value));
    NULL_COMPONENT(DoStep(NULL, 0.0, 1.0, 1));
    NULL_COMPONENT(CancelStep(NULL));
    NULL_COMPONENT(GetStatus(NULL, fmi2DoStepStatus, &status));
    NULL_COMPONENT(GetRealStatus(NULL, fmi2LastSuccessfulTime, &value));
    NULL_COMPONENT(GetIntegerStatus(NULL, fmi2DoStepStatus, &integer));
    NULL_COMPONENT(GetBooleanStatus(NULL, fmi2Terminated, &flag));
    NULL_COMPONENT(GetStringStatus(NULL, fmi2PendingStatus, &text));
}

int main(int count, char **given) {
    CHECK(count == 10);
    fmu = fmu_open(given[1], given[2], given[3]);
    n_inputs = references_read(given[4], inputs);
    n_reals = references_read(given[5], reals);
    CHECK(references_read(given[6], &fixed) == 1 && references_read(given[7], &boolean) == 1);
    in = table_read(given[8]);
    out = table_read(given[9]);
    CHECK(in.columns == n_inputs + 1 && out.columns == n_reals + 1 && in.rows == out.rows && in.rows > 8);
    CHECK(!strcmp(fmu.GetVersion(), "2.0") && !strcmp(fmu.GetTypesPlatform(), "default"));
    reference_run();
    saved_states();
    derivatives();
    refusals();
    CHECK(living == 0); /* every block was given back */
    CHECK(messages[fmi2Error] > 0 && messages[fmi2Discard] > 0);
    free(in.values);
    free(out.values);
    library_close(fmu.library);
    puts("done");
    return 0;
}
