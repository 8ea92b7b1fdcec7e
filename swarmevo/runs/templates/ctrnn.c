#define SWARMEVO_HIDDEN $hidden
#define SWARMEVO_CONTEXT $context

/* Call it when an episode begins: the network forgets what it heard and did before. So it is when the program starts. */
void swarmevo_forget(void);

/* One row or column more than there are units: C has no empty arrays. */
static const double input_hidden[SWARMEVO_HIDDEN + 1][SWARMEVO_OBSERVATIONS] = {
$input_hidden};
static const double hidden_bias[SWARMEVO_HIDDEN + 1] = {
$hidden_bias};
static const double context_hidden[SWARMEVO_HIDDEN + 1][SWARMEVO_CONTEXT + 1] = {
$context_hidden};
/* Share of the way to what drives a unit that its state goes in a control period. */
static const double rates[SWARMEVO_HIDDEN + 1] = {
$rates};
static const double hidden_output[SWARMEVO_HIDDEN + 1][SWARMEVO_COMMANDS] = {
$hidden_output};
static const double output_bias[SWARMEVO_COMMANDS] = {
$output_bias};
static double states[SWARMEVO_HIDDEN + 1];

static double hidden_activation(double x) {
    return $hidden_activation;
}

static double output_activation(double x) {
    return $output_activation;
}

void swarmevo_forget(void) {
    int i;
    for (i = 0; i < SWARMEVO_HIDDEN; ++i) states[i] = 0.0;
}

void swarmevo_controller(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS]) {
    double hidden[SWARMEVO_HIDDEN + 1];
    int h, i, o;
    for (h = 0; h < SWARMEVO_HIDDEN; ++h) hidden[h] = hidden_activation(states[h] + hidden_bias[h]);
    for (h = 0; h < SWARMEVO_HIDDEN; ++h) {
        double drive = 0.0;
        for (i = 0; i < SWARMEVO_OBSERVATIONS; ++i) drive += input_hidden[h][i] * observation[i];
        for (i = 0; i < SWARMEVO_CONTEXT; ++i) drive += context_hidden[h][i] * hidden[i];
        states[h] += rates[h] * (drive - states[h]);
    }
    for (h = 0; h < SWARMEVO_HIDDEN; ++h) hidden[h] = hidden_activation(states[h] + hidden_bias[h]);
    for (o = 0; o < SWARMEVO_COMMANDS; ++o) {
        double sum = output_bias[o];
        for (h = 0; h < SWARMEVO_HIDDEN; ++h) sum += hidden_output[h][o] * hidden[h];
        command[o] = output_activation(sum);
    }
}

