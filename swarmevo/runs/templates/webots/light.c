
#define SWARMEVO_LIGHT_SECTORS $light_sectors
static WbDeviceTag light_receiver;
static struct heard lights[SWARMEVO_SOURCES + 1];

static void enable_light(int step) {
    light_receiver = receiver_named("light receiver", step);
    forget(lights, SWARMEVO_SOURCES);
}

static void hear_light(void) {
    hear(light_receiver, lights, SWARMEVO_SOURCES);
}

static double *sense_light(double *next) {
    int i;
    for (i = 0; i < SWARMEVO_LIGHT_SECTORS; ++i) next[i] = 0.0;
    for (i = 0; i < SWARMEVO_SOURCES; ++i) {
        if (sources[i].channel != -1 || !is_heard(&lights[i])) continue;
        const int sector = sector_of(lights[i].x, lights[i].y, SWARMEVO_LIGHT_SECTORS);
        const double reading = limited(lights[i].strength, sources[i].least, sources[i].most) / sources[i].most;
        if (reading > next[sector]) next[sector] = reading;
    }
    return next + SWARMEVO_LIGHT_SECTORS;
}
