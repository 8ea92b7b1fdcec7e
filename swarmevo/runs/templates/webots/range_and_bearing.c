
#define SWARMEVO_ROBOTS $robots
#define SWARMEVO_SECTORS $sectors
#define SWARMEVO_BITS $bits
#define SWARMEVO_RANGE $range /* [m] */
static WbDeviceTag message_receiver, message_emitter;
static struct heard others[SWARMEVO_ROBOTS];
static int own_number;

static void enable_range_and_bearing(int step, int number) {
    own_number = number;
    message_receiver = receiver_named("range and bearing receiver", step);
    message_emitter = wb_robot_get_device("emitter");
    forget(others, SWARMEVO_ROBOTS);
}

/* A bit of the message is set where its command is above 0. */
static void send_message(const double command[SWARMEVO_COMMANDS]) {
    unsigned char packet[1 + SWARMEVO_BITS];
    int i;
    packet[0] = (unsigned char)own_number;
    for (i = 0; i < SWARMEVO_BITS; ++i) packet[1 + i] = command[2 + i] > 0.0;
    if (message_emitter) wb_emitter_send(message_emitter, packet, 1 + SWARMEVO_BITS);
}

static void hear_messages(void) {
    hear(message_receiver, others, SWARMEVO_ROBOTS);
}

static double *sense_range_and_bearing(double *next) {
    int sector, i;
    for (sector = 0; sector < SWARMEVO_SECTORS; ++sector) {
        const struct heard *nearest = 0;
        for (i = 0; i < SWARMEVO_ROBOTS; ++i)
            if (is_heard(&others[i]) && sector_of(others[i].x, others[i].y, SWARMEVO_SECTORS) == sector &&
                (!nearest || others[i].strength > nearest->strength))
                nearest = &others[i];
        *next++ = nearest ? limited(1.0 - 1.0 / (sqrt(nearest->strength) * SWARMEVO_RANGE), 0.0, 1.0) : 0.0;
        for (i = 0; i < SWARMEVO_BITS; ++i) *next++ = nearest ? nearest->data[1 + i] : 0.0;
    }
    return next;
}
