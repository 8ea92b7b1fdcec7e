
/* The last packet of a sender. Its first byte is the sender's number. */
struct heard {
    int age; /* steps of the world ago; Webots may deliver one late */
    double strength, x, y; /* 1/r^2 [1/m^2]; direction, ahead and to the left */
    unsigned char data[$packet];
};
#define SWARMEVO_SILENT 1000

static void forget(struct heard *heard, int senders) {
    int i;
    for (i = 0; i < senders; ++i) heard[i].age = SWARMEVO_SILENT;
}

static int is_heard(const struct heard *one) {
    return one->age <= 1;
}

static void hear(WbDeviceTag receiver, struct heard *heard, int senders) {
    int i;
    for (i = 0; i < senders; ++i)
        if (heard[i].age < SWARMEVO_SILENT) ++heard[i].age;
    for (; receiver && wb_receiver_get_queue_length(receiver) > 0; wb_receiver_next_packet(receiver)) {
        const unsigned char *data = wb_receiver_get_data(receiver);
        const int size = wb_receiver_get_data_size(receiver);
        if (size < 1 || data[0] >= senders) continue;
        struct heard *one = &heard[data[0]];
        const double *direction = wb_receiver_get_emitter_direction(receiver);
        one->age = 0;
        one->strength = wb_receiver_get_signal_strength(receiver);
        one->x = direction[0];
        one->y = direction[1];
        for (i = 0; i < size && i < (int)sizeof one->data; ++i) one->data[i] = data[i];
    }
}

static WbDeviceTag receiver_named(const char *name, int step) {
    const WbDeviceTag tag = wb_robot_get_device(name);
    if (tag) wb_receiver_enable(tag, step);
    return tag;
}
