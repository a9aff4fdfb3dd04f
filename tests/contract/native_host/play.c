/* Play a table of inputs, held from row to row, and print the outputs at the end of every row as a table.
   play LIBRARY GUID RESOURCES INPUTS REALS IN.csv; INPUTS and REALS are value references. Also for Windows. */
#include "host.h"

int main(int count, char **given) {
    fmi2ValueReference inputs[MOST_COLUMNS], reals[MOST_COLUMNS];
    double values[MOST_COLUMNS];
    size_t n_inputs, n_reals;
    fmi2Component c;
    Table in;
    Fmu fmu;
    CHECK(count == 7);
    fmu = fmu_open(given[1], given[2], given[3]);
    n_inputs = references_read(given[4], inputs);
    n_reals = references_read(given[5], reals);
    in = table_read(given[6]);
    CHECK(in.columns == n_inputs + 1 && in.rows > 1);
    c = begin(&fmu, &callbacks, inputs, n_inputs, table_row(&in, 0) + 1);
    for (size_t row = 0; row + 1 < in.rows; row++) {
        const double time = table_row(&in, row)[0];
        CHECK(fmu.SetReal(c, inputs, n_inputs, table_row(&in, row) + 1) == fmi2OK);
        CHECK(fmu.DoStep(c, time, table_row(&in, row + 1)[0] - time, 1) == fmi2OK);
        CHECK(fmu.GetReal(c, reals, n_reals, values) == fmi2OK);
        for (size_t i = 0; i < n_reals; i++) printf("%.17g%c", values[i], i + 1 < n_reals ? ',' : '\n');
    }
    CHECK(fmu.Terminate(c) == fmi2OK);
    fmu.FreeInstance(c);
    CHECK(living == 0);
    library_close(fmu.library);
    free(in.values);
    return 0;
}
