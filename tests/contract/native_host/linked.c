/* Two FMUs linked into this program from their sources, both played from one table of inputs, step by step in turn;
   prints the outputs of both at the end of every row. Compiled with ONE and TWO: the prefixes of their functions.
   linked GUID_1 INPUTS_1 REALS_1 GUID_2 INPUTS_2 REALS_2 IN.csv */
#include "host.h"

#define JOIN(a, b) a##b
#define NAMED(prefix, name) JOIN(prefix, fmi2##name)
#define DECLARE(name) fmi2##name##TYPE NAMED(ONE, name), NAMED(TWO, name);
FUNCTIONS(DECLARE)
#define FIRST(name) .name = NAMED(ONE, name),
#define SECOND(name) .name = NAMED(TWO, name),

typedef struct {
    Fmu fmu;
    fmi2Component component;
    fmi2ValueReference inputs[MOST_COLUMNS], reals[MOST_COLUMNS];
    size_t n_inputs, n_reals;
} Player;

static void prepare(Player *player, char **given, const Table *in) {
    player->fmu.guid = given[0];
    player->n_inputs = references_read(given[1], player->inputs);
    player->n_reals = references_read(given[2], player->reals);
    CHECK(in->columns == player->n_inputs + 1);
    player->component = begin(&player->fmu, &callbacks, player->inputs, player->n_inputs, table_row(in, 0) + 1);
}

static void step(Player *player, const Table *in, size_t row) {
    const Fmu *fmu = &player->fmu;
    const double time = table_row(in, row)[0];
    double values[MOST_COLUMNS];
    CHECK(fmu->SetReal(player->component, player->inputs, player->n_inputs, table_row(in, row) + 1) == fmi2OK);
    CHECK(fmu->DoStep(player->component, time, table_row(in, row + 1)[0] - time, 1) == fmi2OK);
    CHECK(fmu->GetReal(player->component, player->reals, player->n_reals, values) == fmi2OK);
    for (size_t i = 0; i < player->n_reals; i++) printf("%.17g,", values[i]);
}

int main(int count, char **given) {
    Player players[] = {{.fmu = {FUNCTIONS(FIRST)}}, {.fmu = {FUNCTIONS(SECOND)}}};
    Table in;
    CHECK(count == 8);
    in = table_read(given[7]);
    for (int i = 0; i < 2; i++) prepare(&players[i], given + 1 + 3 * i, &in);
    for (size_t row = 0; row + 1 < in.rows; row++) {
        for (int i = 0; i < 2; i++) step(&players[i], &in, row);
        puts("");
    }
    CHECK(!players[0].fmu.Instantiate("other", fmi2CoSimulation, given[4], NULL, &callbacks, 0, 0)); /* not its GUID */
    for (int i = 0; i < 2; i++) players[i].fmu.FreeInstance(players[i].component);
    CHECK(living == 0);
    free(in.values);
    return 0;
}
