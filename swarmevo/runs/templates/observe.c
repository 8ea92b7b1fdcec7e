
#define SWARMEVO_INFRARED $infrared
#define SWARMEVO_TOUCH $touch
#define SWARMEVO_INFRARED_LARGEST $infrared_largest /* raw value at contact */
#define SWARMEVO_SIGNAL_LEAST $signal_least
#define SWARMEVO_SIGNAL_MOST $signal_most

void swarmevo_observe(const double infrared[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH],
                      double signal_strength, double observation[SWARMEVO_OBSERVATIONS]);

/* Scales raw infrared values, touch in [0, 1] and a signal strength of 1/r^2 [1/m^2] to what the network has learnt. */
void swarmevo_observe(const double infrared[SWARMEVO_INFRARED], const double touch[SWARMEVO_TOUCH],
                      double signal_strength, double observation[SWARMEVO_OBSERVATIONS]) {
    double *next = observation;
    int i = 0;
    (void)infrared, (void)touch, (void)signal_strength, (void)i, (void)next; /* what the controller does not observe */
$observe}
