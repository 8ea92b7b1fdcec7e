/* SPDX-License-Identifier: BSD-3-Clause
 *
 * What a controller needs of Webots' C API, written from its reference manual: a robot whose devices are played from stdin.
 *
 *   STEP PERIOD N       step of the world and of control [ms], number of devices
 *   KIND NAME           N lines; what wb_device_get_node_type says, and the name up to the end of the line
 *   ...                 then a frame for each control step, from the first step of the world on:
 *   v DEVICE VALUE      what it returns from now on
 *   p DEVICE STRENGTH X Y Z N BYTE...   a packet that a receiver gets
 *   .                   end of the frame
 *
 * Before each further frame, and at the end, the velocities of the first two devices and the last packet sent go to stdout. One step
 * after each frame all receivers get stale packets besides, of all senders. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <webots/device.h>
#include <webots/distance_sensor.h>
#include <webots/emitter.h>
#include <webots/motor.h>
#include <webots/nodes.h>
#include <webots/position_sensor.h>
#include <webots/receiver.h>
#include <webots/robot.h>
#include <webots/touch_sensor.h>

#define DEVICES 100
#define PACKETS 200
static int step_ms, period_ms, devices, kinds[DEVICES], enabled[DEVICES], now_ms, packets, size, frames;
static char names[DEVICES][64];
static double values[DEVICES], velocities[DEVICES];
static struct {
    int receiver, size;
    double strength, direction[3];
    unsigned char data[32];
} queue[PACKETS];
static unsigned char sent[32];

static void fail(const char *why) {
    fprintf(stderr, "mock: %s\n", why);
    exit(3);
}

int wb_robot_init(void) {
    int i;
    if (scanf("%d %d %d", &step_ms, &period_ms, &devices) != 3) fail("no header");
    for (i = 1; i <= devices; ++i)
        if (scanf("%d %63[^\n]", &kinds[i], names[i]) != 2) fail("no device");
    for (i = 0; i < DEVICES; ++i) values[i] = NAN;
    return 1;
}

void wb_robot_cleanup(void) {}

double wb_robot_get_basic_time_step(void) {
    return step_ms;
}

double wb_robot_get_time(void) {
    return now_ms / 1000.0;
}

int wb_robot_get_number_of_devices(void) {
    return devices;
}

WbDeviceTag wb_robot_get_device_by_index(int index) {
    return (WbDeviceTag)(index + 1);
}

WbDeviceTag wb_robot_get_device(const char *name) {
    int i;
    for (i = 1; i <= devices; ++i)
        if (!strcmp(names[i], name)) return (WbDeviceTag)i;
    return 0;
}

const char *wb_device_get_name(WbDeviceTag tag) {
    return names[tag];
}

WbNodeType wb_device_get_node_type(WbDeviceTag tag) {
    return (WbNodeType)kinds[tag];
}

static void enable(WbDeviceTag tag, int period) {
    if (!tag || period != step_ms) fail("enabled nothing, or not in each step");
    enabled[tag] = 1;
}

static double value(WbDeviceTag tag) {
    if (!enabled[tag]) fail("read before it was enabled");
    return values[tag];
}

static void add_packet(int receiver, double strength, double x, double y, double z, int bytes) {
    if (packets == PACKETS) fail("too many packets");
    queue[packets].receiver = receiver;
    queue[packets].strength = strength;
    queue[packets].direction[0] = x, queue[packets].direction[1] = y, queue[packets].direction[2] = z;
    queue[packets].size = bytes;
    ++packets;
}

static void stale(void) {
    int i, sender;
    for (i = 1; i <= devices; ++i)
        for (sender = 0; enabled[i] && strstr(names[i], "receiver") && sender < 8; ++sender) {
            add_packet(i, 1e6, -1.0, 0.0, 0.0, 2);
            queue[packets - 1].data[0] = (unsigned char)sender, queue[packets - 1].data[1] = 1;
        }
}

static void report(void) {
    int i;
    printf("%a %a", velocities[1], velocities[2]);
    for (i = 0; i < size; ++i) printf(" %d", sent[i]);
    printf("\n");
}

static int frame(void) {
    char what;
    while (scanf(" %c", &what) == 1) {
        int device, bytes, i, byte;
        double strength, x, y, z;
        if (what == '.') return 1;
        if (scanf("%d", &device) != 1) fail("no device in a frame");
        if (what == 'v') {
            if (scanf("%lf", &values[device]) != 1) fail("no value");
            continue;
        }
        if (scanf("%lf %lf %lf %lf %d", &strength, &x, &y, &z, &bytes) != 5) fail("no packet");
        add_packet(device, strength, x, y, z, bytes);
        for (i = 0; i < bytes; ++i) {
            if (scanf("%d", &byte) != 1) fail("no byte");
            queue[packets - 1].data[i] = (unsigned char)byte;
        }
    }
    return 0;
}

int wb_robot_step(int duration) {
    if (duration <= 0 || duration % step_ms) fail("stepped by no multiple of the world's step");
    now_ms += duration;
    if ((now_ms - step_ms) % period_ms == step_ms) stale();
    if ((now_ms - step_ms) % period_ms) return 0;
    if (frames++) report();
    return frame() ? 0 : -1;
}

void wb_distance_sensor_enable(WbDeviceTag tag, int period) {
    enable(tag, period);
}

double wb_distance_sensor_get_value(WbDeviceTag tag) {
    return value(tag);
}

void wb_touch_sensor_enable(WbDeviceTag tag, int period) {
    enable(tag, period);
}

double wb_touch_sensor_get_value(WbDeviceTag tag) {
    return value(tag);
}

void wb_position_sensor_enable(WbDeviceTag tag, int period) {
    enable(tag, period);
}

double wb_position_sensor_get_value(WbDeviceTag tag) {
    return value(tag);
}

void wb_motor_set_position(WbDeviceTag tag, double position) {
    if (!tag || !isinf(position)) fail("a motor that goes to a place");
}

void wb_motor_set_velocity(WbDeviceTag tag, double velocity) {
    velocities[tag] = velocity;
}

int wb_emitter_send(WbDeviceTag tag, const void *data, int bytes) {
    if (!tag || bytes < 1 || bytes > (int)sizeof sent) fail("sent nothing");
    memcpy(sent, data, (size_t)bytes);
    size = bytes;
    return 1;
}

void wb_receiver_enable(WbDeviceTag tag, int period) {
    enable(tag, period);
}

static int head(WbDeviceTag tag) {
    int i;
    for (i = 0; i < packets; ++i)
        if (queue[i].receiver == tag) return i;
    return -1;
}

int wb_receiver_get_queue_length(WbDeviceTag tag) {
    int i, n = 0;
    for (i = 0; i < packets; ++i) n += queue[i].receiver == tag;
    return n;
}

static int next_of(WbDeviceTag tag) {
    const int i = head(tag);
    if (i < 0) fail("read from an empty queue");
    return i;
}

const void *wb_receiver_get_data(WbDeviceTag tag) {
    return queue[next_of(tag)].data;
}

int wb_receiver_get_data_size(WbDeviceTag tag) {
    return queue[next_of(tag)].size;
}

double wb_receiver_get_signal_strength(WbDeviceTag tag) {
    return queue[next_of(tag)].strength;
}

const double *wb_receiver_get_emitter_direction(WbDeviceTag tag) {
    return queue[next_of(tag)].direction;
}

void wb_receiver_next_packet(WbDeviceTag tag) {
    const int i = next_of(tag);
    memmove(&queue[i], &queue[i + 1], (size_t)(packets - i - 1) * sizeof queue[0]);
    --packets;
}
