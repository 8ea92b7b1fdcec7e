// SPDX-License-Identifier: BSD-3-Clause
// Box2D peer, seen from above: five E-pucks, a box, walls. Prints one JSON line.
//   g++ -std=c++17 -O2 box2d_scene.cpp -lbox2d -o box2d_scene
//   box2d_scene roaming|pushing|random --networks FILE [--dt 0.01] [--seconds 180] [--episodes 1]
//               [--box-friction 0.62] [--noise 1] [--overlap 0]
// FILE has one network a line, from benchmarks.cases.write_networks; episode i is driven by network i modulo their
// number. The rate is simulated seconds for each second of CPU time, with sensing, networks, noise and making the
// worlds.
//
// A robot is a disc on a tread that moves as its wheels would have it: a kinematic body without a shape, tied to it by
// a friction joint, so that the solver weighs drive and contacts against each other. A force of
// mass * (wanted - actual) / dt instead would be off by as much as a robot pushes, in proportion to the step.
#include <box2d/box2d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

// ---- the scene, as swarmevo/config/models.py has it; in m, kg, s, rad ----

constexpr int kRobots = 5, kInfrared = 8, kTouch = 4, kInputs = kInfrared + kTouch + 1, kHidden = 15;
constexpr float kGravity = 9.81f;          // [m/s^2]
constexpr float kArenaSize = 1;            // [m]
constexpr float kWideArenaSize = 20;       // of `pushing` [m]
constexpr float kBoxLength = 0.275f;       // along x [m]
constexpr float kBoxWidth = 0.18f;         // along y [m]
constexpr float kBoxMass = 0.24f;          // [kg]
constexpr float kBoxY = 0.345f;            // at the start [m]; the emitter is above it
constexpr float kRobotRadius = 0.035f;     // [m]
constexpr float kRobotMass = 0.08f;        // [kg]
constexpr float kCentreOfMass = 0.015f;    // above the floor [m]
constexpr float kCasterOffset = 0.03f;     // from the axle [m]
constexpr float kAxleLength = 0.053f;      // [m]
constexpr float kTopSpeed = 0.128740f;     // of a rim: 6.28 rad/s at 20.5 mm [m/s]
constexpr float kWheelFriction = 1;        // [1]
constexpr float kBoxFriction = 0.62f;      // of the floor, unless told otherwise [1]
constexpr float kSideFriction = 0.2f;      // [1]
constexpr float kRowY = -0.4f;             // [m]
constexpr float kRowSpacing = 0.12f;       // [m]
constexpr float kPositionJitter = 0.01f;   // [m]
constexpr float kHeadingJitter = 0.1f;     // [rad]
constexpr float kPusherSpacing = 0.0715f;  // of `pushing` [m]
constexpr float kPusherGap = 0.002f;       // from the box [m]
constexpr float kBoxToSouthWall = 0.6f;    // of `pushing`, from the box's centre [m]
constexpr float kControlPeriod = 0.1f;     // [s]
constexpr float kWheelNoise = 0.05f;       // largest relative error [1]

constexpr float kInfraredNoise = 0.05f, kInfraredNoiseAtContact = 0.005f;  // relative standard deviations [1]
constexpr float kInfraredYawDeg[kInfrared] = {-17.2f, -45.9f, -90, -151.5f, 151.2f, 90, 45.8f, 17.1f};  // [deg]
constexpr float kInfraredCurve[][2] = {{0, 4095},    {0.005f, 3474}, {0.01f, 2211}, {0.02f, 676}, {0.03f, 306},
                                       {0.04f, 164}, {0.05f, 90},    {0.06f, 56},   {0.07f, 34}};  // [m], raw value [1]
constexpr float kInfraredRange = 0.07f;                                                            // [m]
constexpr float kTouchYawDeg[kTouch] = {45, 15, -15, -45};                                         // [deg]
constexpr float kTouchHalfWidthDeg = 15;                                                           // [deg]
constexpr float kTouchRange = 0.002f;                                                              // [m]
constexpr float kEmitterRange = 0.3f, kEmitterAboveReceiver = -0.02f;                              // [m]
constexpr float kLeastStrength = 1, kMostStrength = 50;                                            // [1]

// What a robot pushes with: its own friction tips it onto a caster (native/src/epuck.hpp). Simplification: the same
// limit sideways, where a robot that does not push has up to kWheelFriction * kRobotMass * kGravity.
constexpr float kTraction =
    kWheelFriction * kRobotMass * kGravity / (1 + kWheelFriction * kCentreOfMass / kCasterOffset);  // [N]
constexpr float kTurningTraction = kWheelFriction * kRobotMass * kGravity * kAxleLength / 2;        // [N m]

// ---- what Box2D wants ----

// Its slop and skin of 5 and 10 mm are for bodies of 0.1 to 10 of its units: ours are in decimetres.
constexpr float kScale = 10;                                     // units per metre
constexpr int kVelocityIterations = 8, kPositionIterations = 3;  // its manual's
constexpr std::uint16_t kBoxCategory = 2;                        // not 1, the default

float radians(float degrees) {
    return degrees * b2_pi / 180;
}

float clamp(float x, float low, float high) {
    return std::min(std::max(x, low), high);
}

// ---- networks ----

struct Network {
    std::array<std::array<float, kInputs + 1>, kHidden> hidden;  // those that are on; the last weight is the bias
    std::array<std::array<float, kHidden>, 2> output;
    std::array<float, 2> output_bias;
    int units = 0;

    std::array<float, 2> operator()(const std::array<float, kInputs>& input) const {
        std::array<float, kHidden> h;
        for (int i = 0; i < units; ++i) {
            float sum = hidden[i][kInputs];
            for (int k = 0; k < kInputs; ++k) sum += hidden[i][k] * input[k];
            h[i] = std::tanh(sum);
        }
        std::array<float, 2> command;
        for (int side = 0; side < 2; ++side) {
            float sum = output_bias[side];
            for (int i = 0; i < units; ++i) sum += output[side][i] * h[i];
            command[side] = std::tanh(sum);
        }
        return command;
    }
};

// A line: 15 rows of 13 weights and a bias, 2 rows of 15 weights and a bias, 15 switches.
Network network_of(const std::string& line) {
    constexpr int kOutputs = kHidden * (kInputs + 1), kSwitches = kOutputs + 2 * (kHidden + 1);
    std::vector<float> numbers;
    std::istringstream text(line);
    for (float number; text >> number; text.ignore(1, ',')) numbers.push_back(number);
    if (numbers.size() != kSwitches + kHidden)
        throw std::runtime_error("expected " + std::to_string(kSwitches + kHidden) + " numbers for a network, got " +
                                 std::to_string(numbers.size()));
    Network network;
    for (int i = 0; i < kHidden; ++i) {
        if (numbers[kSwitches + i] == 0) continue;
        std::copy_n(&numbers[i * (kInputs + 1)], kInputs + 1, network.hidden[network.units].begin());
        for (int side = 0; side < 2; ++side)
            network.output[side][network.units] = numbers[kOutputs + side * (kHidden + 1) + i];
        ++network.units;
    }
    for (int side = 0; side < 2; ++side) network.output_bias[side] = numbers[kOutputs + side * (kHidden + 1) + kHidden];
    return network;
}

std::vector<Network> read_networks(const std::string& path) {
    std::ifstream file(path);
    std::vector<Network> networks;
    for (std::string line; std::getline(file, line);) networks.push_back(network_of(line));
    if (networks.empty()) throw std::runtime_error("expected a file of networks, got none in '" + path + "'");
    return networks;
}

// ---- the world ----

struct Settings {
    std::string name, networks;
    float dt, seconds, box_friction;
    int episodes;
    bool noise, overlap;

    bool pushing() const { return name == "pushing"; }
    float arena() const { return pushing() ? kWideArenaSize : kArenaSize; }
    float box_y() const { return pushing() ? -kWideArenaSize / 2 + kBoxToSouthWall : kBoxY; }
};

struct Robot {
    b2Body *body, *tread;
    float speed, turn;  // that its wheels want [m/s], [rad/s]
};

class NearestHit : public b2RayCastCallback {
  public:
    float ReportFixture(b2Fixture* fixture, const b2Vec2&, const b2Vec2&, float fraction) override {
        if (fixture->GetFilterData().categoryBits == kBoxCategory) return -1;  // infrared looks over the box
        nearest = fraction;
        return fraction;
    }

    float nearest = 1;
};

class World {
  public:
    World(const Settings& settings, std::mt19937& random) : settings_(settings), random_(random) {
        const b2BodyDef still;
        ground_ = world_.CreateBody(&still);
        add_walls();
        add_box();
        for (int i = 0; i < kRobots; ++i) add_robot(i);
    }

    void control(const Network& network) {
        for (Robot& robot : robots_) drive(robot, network(observe(robot)));
        for (int i = std::lround(kControlPeriod / settings_.dt); i > 0; --i) step();
    }

    // Of the box from its start [m].
    float way() const { return (box_->GetPosition() - kScale * b2Vec2(0, settings_.box_y())).Length() / kScale; }

    // The deepest of all steps [m], where it is measured.
    float overlap() const { return overlap_; }

  private:
    void add_walls() {
        const float half = kScale * settings_.arena() / 2;
        const b2Vec2 corners[] = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
        for (int i = 0; i < 4; ++i) {
            b2EdgeShape wall;
            wall.SetTwoSided(corners[i], corners[(i + 1) % 4]);
            ground_->CreateFixture(&wall, 0)->SetFriction(kSideFriction);
        }
    }

    void add_box() {
        box_ = add_body(b2_dynamicBody, 0, settings_.box_y(), 0);
        b2PolygonShape shape;  // its skin is outside of its corners
        shape.SetAsBox(kScale * kBoxLength / 2 - b2_polygonRadius, kScale * kBoxWidth / 2 - b2_polygonRadius);
        b2Filter filter;
        filter.categoryBits = kBoxCategory;
        add_shape(box_, shape)->SetFilterData(filter);
        const float length = kScale * kBoxLength, width = kScale * kBoxWidth;
        set_mass(box_, kBoxMass, kBoxMass * (length * length + width * width) / 12);
        // It stands on its corners. Simplification: sliding does not weaken what holds it from turning.
        const float hold = settings_.box_friction * kBoxMass * kGravity;
        rub(ground_, box_, hold, hold * std::hypot(kBoxLength, kBoxWidth) / 2);
    }

    void add_robot(int number) {
        const float place = number - (kRobots - 1) / 2.f;
        if (settings_.pushing()) {
            const float y = settings_.box_y() - kBoxWidth / 2 - kRobotRadius - kPusherGap;
            add_robot(kPusherSpacing * place, y, b2_pi / 2);
        } else {
            const float x = kRowSpacing * place + kPositionJitter * symmetric();
            const float y = kRowY + kPositionJitter * symmetric();
            add_robot(x, y, -b2_pi / 2 + kHeadingJitter * symmetric());
        }
    }

    void add_robot(float x, float y, float heading) {
        Robot robot{add_body(b2_dynamicBody, x, y, heading), add_body(b2_kinematicBody, x, y, heading), 0, 0};
        b2CircleShape shape;
        shape.m_radius = kScale * kRobotRadius;
        add_shape(robot.body, shape);
        set_mass(robot.body, kRobotMass, kRobotMass * shape.m_radius * shape.m_radius / 2);
        rub(robot.tread, robot.body, kTraction, kTurningTraction);
        robots_.push_back(robot);
    }

    b2Body* add_body(b2BodyType type, float x, float y, float heading) {
        b2BodyDef body;
        body.type = type;
        body.position = kScale * b2Vec2(x, y);
        body.angle = heading;
        return world_.CreateBody(&body);
    }

    static b2Fixture* add_shape(b2Body* body, const b2Shape& shape) {
        b2Fixture* fixture = body->CreateFixture(&shape, 1);
        fixture->SetFriction(kSideFriction);
        return fixture;
    }

    // Inertia in Box2D's units.
    static void set_mass(b2Body* body, float mass, float inertia) {
        const b2MassData data{mass, {0, 0}, inertia};
        body->SetMassData(&data);
    }

    // Holds two bodies' velocities together, up to a force [N] and a torque [N m].
    void rub(b2Body* first, b2Body* second, float force, float torque) {
        b2FrictionJointDef joint;
        joint.bodyA = first;
        joint.bodyB = second;
        joint.maxForce = kScale * force;
        joint.maxTorque = kScale * kScale * torque;
        joint.collideConnected = true;  // the box with the walls
        world_.CreateJoint(&joint);
    }

    // ---- sensing ----

    std::array<float, kInputs> observe(const Robot& robot) {
        std::array<float, kInputs> inputs{};
        sense_infrared(robot, &inputs[0]);
        sense_touch(robot, &inputs[kInfrared]);
        const b2Vec2 at = (1 / kScale) * robot.body->GetPosition();
        const float square =
            at.x * at.x + (at.y - kBoxY) * (at.y - kBoxY) + kEmitterAboveReceiver * kEmitterAboveReceiver;
        const bool hears = square <= kEmitterRange * kEmitterRange;
        inputs[kInputs - 1] =
            (hears ? clamp(1 / square, kLeastStrength, kMostStrength) : kLeastStrength) / kMostStrength;
        return inputs;
    }

    // Rays from the centre: from the rim they would begin within what touches the robot, and miss it.
    void sense_infrared(const Robot& robot, float* readings) {
        const b2Vec2 centre = robot.body->GetPosition();
        constexpr float kReach = kRobotRadius + kInfraredRange;
        for (int i = 0; i < kInfrared; ++i) {
            const float angle = robot.body->GetAngle() + radians(kInfraredYawDeg[i]);
            NearestHit hit;
            world_.RayCast(&hit, centre, centre + kScale * kReach * b2Vec2(std::cos(angle), std::sin(angle)));
            if (hit.nearest == 1) continue;
            const float distance = std::max(0.f, hit.nearest * kReach - kRobotRadius);
            readings[i] = infrared_response(distance);
            if (settings_.noise)
                readings[i] = clamp(readings[i] * (1 + infrared_deviation(distance) * normal_(random_)), 0, 1);
        }
    }

    static float infrared_response(float distance) {
        for (std::size_t i = 1; i < std::size(kInfraredCurve); ++i) {
            const auto& [from, high] = kInfraredCurve[i - 1];
            const auto& [to, low] = kInfraredCurve[i];
            if (distance <= to) return (high + (distance - from) / (to - from) * (low - high)) / kInfraredCurve[0][1];
        }
        return 0;
    }

    static float infrared_deviation(float distance) {
        const float share = std::min(1.f, distance / kInfraredCurve[1][0]);
        return kInfraredNoiseAtContact + share * (kInfraredNoise - kInfraredNoiseAtContact);
    }

    // From a robot's centre to the box's nearest point [m].
    b2Vec2 to_box(const Robot& robot) const {
        const b2Vec2 local = (1 / kScale) * box_->GetLocalPoint(robot.body->GetPosition());
        const b2Vec2 nearest(clamp(local.x, -kBoxLength / 2, kBoxLength / 2),
                             clamp(local.y, -kBoxWidth / 2, kBoxWidth / 2));
        return box_->GetWorldVector(nearest - local);
    }

    void sense_touch(const Robot& robot, float* readings) const {
        const b2Vec2 nearest = to_box(robot);
        if (nearest.Length() > kRobotRadius + kTouchRange) return;
        const b2Vec2 towards = robot.body->GetLocalVector(nearest);
        const float bearing = std::atan2(towards.y, towards.x);
        for (int i = 0; i < kTouch; ++i)
            readings[i] = std::abs(bearing - radians(kTouchYawDeg[i])) <= radians(kTouchHalfWidthDeg);
    }

    // ---- moving ----

    void drive(Robot& robot, const std::array<float, 2>& command) {
        const float left = kTopSpeed * command[0] * wheel_error(), right = kTopSpeed * command[1] * wheel_error();
        robot.speed = (left + right) / 2;
        robot.turn = (right - left) / kAxleLength;
        robot.tread->SetAngularVelocity(robot.turn);
    }

    void step() {
        for (Robot& robot : robots_) {
            const float heading = robot.body->GetAngle() + robot.turn * settings_.dt / 2;  // mid-step
            robot.tread->SetLinearVelocity(kScale * robot.speed * b2Vec2(std::cos(heading), std::sin(heading)));
        }
        world_.Step(settings_.dt, kVelocityIterations, kPositionIterations);
        if (settings_.overlap) overlap_ = std::max(overlap_, deepest_overlap());
    }

    // How far robots are within each other or the box now [m].
    float deepest_overlap() const {
        float deepest = 0;
        for (const Robot& robot : robots_) {
            deepest = std::max(deepest, kRobotRadius - to_box(robot).Length());
            for (const Robot* other = robots_.data(); other != &robot; ++other) {
                const b2Vec2 apart = robot.body->GetPosition() - other->body->GetPosition();
                deepest = std::max(deepest, 2 * kRobotRadius - apart.Length() / kScale);
            }
        }
        return deepest;
    }

    float wheel_error() { return settings_.noise ? 1 + kWheelNoise * symmetric() : 1; }

    float symmetric() { return std::uniform_real_distribution<float>(-1, 1)(random_); }

    const Settings& settings_;
    std::mt19937& random_;
    std::normal_distribution<float> normal_;
    b2World world_{b2Vec2(0, 0)};
    b2Body *ground_, *box_;
    std::vector<Robot> robots_;
    float overlap_ = 0;
};

// ---- the program ----

Settings settings_of(int count, char** words) {
    std::map<std::string, std::string> options = {{"--networks", ""},
                                                  {"--dt", "0.01"},
                                                  {"--seconds", "180"},
                                                  {"--episodes", "1"},
                                                  {"--box-friction", std::to_string(kBoxFriction)},
                                                  {"--noise", "1"},
                                                  {"--overlap", "0"}};
    if (count < 2 || count % 2)
        throw std::runtime_error("expected roaming, pushing or random, then options with one value each");
    if (const std::string name = words[1]; name != "roaming" && name != "pushing" && name != "random")
        throw std::runtime_error("expected roaming, pushing or random, got " + name);
    for (int i = 2; i < count; i += 2) {
        const auto option = options.find(words[i]);
        if (option == options.end()) throw std::runtime_error(std::string("no such option: ") + words[i]);
        option->second = words[i + 1];
    }
    return {words[1],
            options["--networks"],
            std::stof(options["--dt"]),
            std::stof(options["--seconds"]),
            std::stof(options["--box-friction"]),
            std::stoi(options["--episodes"]),
            options["--noise"] != "0",
            options["--overlap"] != "0"};
}

double cpu_seconds() {
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void run(const Settings& settings) {
    const std::vector<Network> networks = read_networks(settings.networks);
    const long controls = std::lround(settings.seconds / kControlPeriod);
    const double start = cpu_seconds();
    double way = 0;
    float overlap = 0;
    for (int episode = 0; episode < settings.episodes; ++episode) {
        std::mt19937 random(static_cast<unsigned>(episode));
        World world(settings, random);
        for (long i = 0; i < controls; ++i) world.control(networks[episode % networks.size()]);
        way += world.way() / settings.episodes;
        overlap = std::max(overlap, world.overlap());
    }
    const double rate = settings.episodes * static_cast<double>(settings.seconds) / (cpu_seconds() - start);
    // 2.4.1 says of itself that it is 2.4.0.
    std::printf("{\"peer\": \"box2d\", \"version\": \"%d.%d.%d\", \"case\": \"%s\", \"dt\": %g, ", b2_version.major,
                b2_version.minor, b2_version.revision, settings.name.c_str(), settings.dt);
    std::printf("\"realtime_factor_per_cpu_s\": %.1f, \"box_way_m\": %.6f, ", rate, way);
    if (settings.overlap) std::printf("\"deepest_overlap_mm\": %.3f, ", 1000 * overlap);
    std::printf("\"note\": {\"seconds\": %g, \"episodes\": %d, \"box_friction\": %g, \"noise\": %d}}\n",
                settings.seconds, settings.episodes, settings.box_friction, settings.noise);
}

}  // namespace

int main(int count, char** words) {
    try {
        run(settings_of(count, words));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "box2d_scene: %s\n", error.what());
        return 1;
    }
}
