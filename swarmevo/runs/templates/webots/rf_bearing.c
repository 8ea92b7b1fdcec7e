
static double *sense_rf_bearing(double *next) {
    int channel, i;
    for (channel = 0; channel < SWARMEVO_CHANNELS; ++channel) {
        const struct heard *nearest = 0;
        for (i = 0; i < SWARMEVO_SOURCES; ++i)
            if (sources[i].channel == channel && is_heard(&signals[i]) &&
                (!nearest || signals[i].strength > nearest->strength))
                nearest = &signals[i];
        const double length = nearest ? hypot(nearest->x, nearest->y) : 0.0;
        *next++ = length > 0.0 ? nearest->x / length : 0.0;
        *next++ = length > 0.0 ? nearest->y / length : 0.0;
    }
    return next;
}
