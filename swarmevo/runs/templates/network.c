/* SPDX-License-Identifier: BSD-3-Clause
 *
 * $title
 *
 * A feed-forward network: $hidden hidden units, $activation. C99, needs nothing but libm.
 *   observation  $names
 *   command      left and right wheel in [-1, 1] of the top speed
 */
#include <math.h>

#define SWARMEVO_OBSERVATIONS $observations
#define SWARMEVO_INFRARED $infrared
#define SWARMEVO_TOUCH $touch
#define SWARMEVO_COMMANDS $commands
#define SWARMEVO_HIDDEN $hidden
#define SWARMEVO_CONTROL_PERIOD_MS $control_period_ms /* between two commands, as evolved */
#define SWARMEVO_INFRARED_LARGEST $infrared_largest /* raw value at contact */
#define SWARMEVO_SIGNAL_LEAST $signal_least
#define SWARMEVO_SIGNAL_MOST $signal_most
#define SWARMEVO_TOP_SPEED $top_speed /* of a wheel [rad/s] */

void swarmevo_controller(const double observation[SWARMEVO_OBSERVATIONS], double command[SWARMEVO_COMMANDS]);
void swarmevo_observe(const double infrared[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH],
                      double signal_strength, double observation[SWARMEVO_OBSERVATIONS]);

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

static double limited(double value, double least, double most) {
    return value < least ? least : value > most ? most : value;
}

/* Scales raw infrared values, touch in [0, 1] and a signal strength of 1/r^2 [1/m^2] to what the network has learnt. */
void swarmevo_observe(const double infrared[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH],
                      double signal_strength, double observation[SWARMEVO_OBSERVATIONS]) {
    double *next = observation;
    int i = 0;
    (void)infrared, (void)touch, (void)signal_strength, (void)i, (void)next; /* what the controller does not observe */
$observe}
