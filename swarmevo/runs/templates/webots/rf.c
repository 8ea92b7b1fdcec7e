
static double *sense_rf(double *next) {
    double strongest = 0.0;
    int i;
    for (i = 0; i < SWARMEVO_SOURCES; ++i) {
        if (!sources[i].is_homed_in_on) continue;
        const double strength =
            is_heard(&signals[i]) ? limited(signals[i].strength, sources[i].least, sources[i].most) : sources[i].least;
        if (strength > strongest) strongest = strength;
    }
    *next++ = strongest / SWARMEVO_SIGNAL_MOST;
    return next;
}
