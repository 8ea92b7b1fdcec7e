
#define SWARMEVO_INFRARED $infrared
static WbDeviceTag infrared[SWARMEVO_INFRARED];

static void enable_infrared(int step) {
    char name[16];
    int i;
    for (i = 0; i < SWARMEVO_INFRARED; ++i) {
        sprintf(name, "ps%d", i);
        infrared[i] = wb_robot_get_device(name);
        if (infrared[i]) wb_distance_sensor_enable(infrared[i], step);
    }
}

static double *sense_infrared(double *next) {
    int i;
    for (i = 0; i < SWARMEVO_INFRARED; ++i) {
        const double value = infrared[i] ? wb_distance_sensor_get_value(infrared[i]) : 0.0;
        *next++ = $reading;
    }
    return next;
}
