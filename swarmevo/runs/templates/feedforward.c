#define SWARMEVO_HIDDEN $hidden

/* One row more than there are units: C has no empty arrays. */
static const double input_hidden[SWARMEVO_HIDDEN + 1][SWARMEVO_OBSERVATIONS] = {
$input_hidden};
static const double hidden_bias[SWARMEVO_HIDDEN + 1] = {
$hidden_bias};
static const double hidden_output[SWARMEVO_HIDDEN + 1][SWARMEVO_COMMANDS] = {
$hidden_output};
static const double output_bias[SWARMEVO_COMMANDS] = {
$output_bias};

static double hidden_activation(double x) {
    return $hidden_activation;
}

static double output_activation(double x) {
    return $output_activation;
}

void swarmevo_controller(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS]) {
    double sums[SWARMEVO_COMMANDS];
    int h, i, o;
    for (o = 0; o < SWARMEVO_COMMANDS; ++o) sums[o] = output_bias[o];
    for (h = 0; h < SWARMEVO_HIDDEN; ++h) {
        double sum = hidden_bias[h];
        for (i = 0; i < SWARMEVO_OBSERVATIONS; ++i) sum += input_hidden[h][i] * observation[i];
        sum = hidden_activation(sum);
        for (o = 0; o < SWARMEVO_COMMANDS; ++o) sums[o] += hidden_output[h][o] * sum;
    }
    for (o = 0; o < SWARMEVO_COMMANDS; ++o) command[o] = output_activation(sums[o]);
}

