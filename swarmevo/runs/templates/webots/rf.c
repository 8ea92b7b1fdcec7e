
/* The largest signal strength of each channel. */
static const double signal_most[SWARMEVO_CHANNELS] = {$signal_most};

static double *sense_rf(double *next) {
    int channel, i;
    for (channel = 0; channel < SWARMEVO_CHANNELS; ++channel) {
        double strongest = 0.0;
        for (i = 0; i < SWARMEVO_SOURCES; ++i) {
            if (sources[i].channel != channel) continue;
            const double strength =
                is_heard(&signals[i]) ? limited(signals[i].strength, sources[i].least, sources[i].most) : sources[i].least;
            if (strength > strongest) strongest = strength;
        }
        *next++ = strongest / signal_most[channel];
    }
    return next;
}
