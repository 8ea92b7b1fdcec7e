static const double input_output[SWARMEVO_COMMANDS][SWARMEVO_OBSERVATIONS] = {
$input_output};
static const double output_bias[SWARMEVO_COMMANDS] = {
$output_bias};

static double output_activation(double x) {
    return $output_activation;
}

void swarmevo_controller(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS]) {
    int i, o;
    for (o = 0; o < SWARMEVO_COMMANDS; ++o) {
        double sum = output_bias[o];
        for (i = 0; i < SWARMEVO_OBSERVATIONS; ++i) sum += input_output[o][i] * observation[i];
        command[o] = output_activation(sum);
    }
}

