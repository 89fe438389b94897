// A reactive navigator for the stack protocol of simscen in one file: C++17, POSIX, no libraries.
//
//     g++ -std=c++17 -O2 -o gap_follower gap_follower.cpp
//     simscen run scenarios/navigation --stack gaps=./gap_follower
//
// It drives in the free direction nearest to the goal (Borenstein and Koren's VFH, reduced to one scan), localizes by
// odometry only, and reports a goal as reached at its estimated pose. docs/reference/stack-protocol.md specifies the
// protocol.

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

using Bytes = std::vector<uint8_t>;

enum Kind : uint8_t { HELLO = 1, WELCOME, GOAL, STEP, ANSWER, PREEMPT, CANCEL, END, ERROR, BYE };

// ---------------------------------------------------------------- frames: u32 size, u8 kind, body; little endian

struct Socket {
    int fd;

    void read_exactly(void* to, size_t size) {
        for (auto at = static_cast<uint8_t*>(to); size > 0;) {
            ssize_t got = ::read(fd, at, size);
            if (got <= 0) throw std::runtime_error("simscen closed the connection");
            at += got, size -= got;
        }
    }

    void write_exactly(const void* from, size_t size) {
        for (auto at = static_cast<const uint8_t*>(from); size > 0;) {
            ssize_t put = ::write(fd, at, size);
            if (put <= 0) throw std::runtime_error("simscen closed the connection");
            at += put, size -= put;
        }
    }

    uint8_t receive(Bytes& body) {
        uint32_t size = 0;
        uint8_t kind = 0;
        read_exactly(&size, 4);
        read_exactly(&kind, 1);
        body.resize(size - 1);
        read_exactly(body.data(), body.size());
        return kind;
    }

    void send(uint8_t kind, const Bytes& body) {
        uint32_t size = body.size() + 1;
        write_exactly(&size, 4);
        write_exactly(&kind, 1);
        write_exactly(body.data(), body.size());
    }

    void send(uint8_t kind, const std::string& json) { send(kind, Bytes(json.begin(), json.end())); }
};

// ---------------------------------------------------------------- JSON reader for HELLO, GOAL, and PREEMPT

struct Json {
    std::map<std::string, Json> fields;
    std::vector<Json> items;
    std::string text;
    double number = 0;
    bool truth = false;

    const Json& operator[](const std::string& key) const { return fields.at(key); }
};

struct Parser {
    const char* at;

    Json value() {
        Json json;
        space();
        if (*at == '{') {
            for (++at, space(); *at != '}'; comma()) {
                space();
                std::string key = string();
                space(), ++at;  // the colon
                json.fields[key] = value();
            }
            ++at;
        } else if (*at == '[') {
            for (++at, space(); *at != ']'; comma()) json.items.push_back(value());
            ++at;
        } else if (*at == '"') {
            json.text = string();
        } else if (*at == 't' || *at == 'f' || *at == 'n') {
            json.truth = *at == 't';
            while (std::isalpha(*at)) ++at;
        } else {
            char* end;
            json.number = std::strtod(at, &end);
            if (end == at) throw std::runtime_error("this is not JSON");
            at = end;
        }
        return json;
    }

    void space() { while (std::isspace(*at)) ++at; }
    void comma() { if (space(), *at == ',') ++at; space(); }

    std::string string() {  // escapes stay unchanged, because names are only sent back
        const char* begin = ++at;
        for (; *at && *at != '"'; ++at) if (*at == '\\') ++at;
        return std::string(begin, at++);
    }
};

Json parsed(Bytes body) {
    body.push_back(0);
    return Parser{reinterpret_cast<const char*>(body.data())}.value();
}

// ---------------------------------------------------------------- CDR: fields aligned to their width, after 4 bytes

struct Reader {
    const uint8_t* data;
    size_t at = 4;

    template <class T> T take() {
        at = 4 + (at - 4 + sizeof(T) - 1) / sizeof(T) * sizeof(T);
        T value;
        std::memcpy(&value, data + at, sizeof(T));
        at += sizeof(T);
        return value;
    }
    void skip_string() { at += take<uint32_t>(); }
    void header() { take<int32_t>(), take<uint32_t>(), skip_string(); }
};

struct Writer {
    Bytes bytes{0, 1, 0, 0};

    template <class T> Writer& put(T value) {
        bytes.resize(4 + (bytes.size() - 4 + sizeof(T) - 1) / sizeof(T) * sizeof(T));
        raw(&value, sizeof(T));
        return *this;
    }
    Writer& string(const std::string& text) {
        put<uint32_t>(text.size() + 1);
        raw(text.c_str(), text.size() + 1);
        return *this;
    }
    void raw(const void* from, size_t size) {
        auto begin = static_cast<const uint8_t*>(from);
        bytes.insert(bytes.end(), begin, begin + size);
    }
};

// ---------------------------------------------------------------- navigator

struct Pose { double x, y, yaw; };
struct Goal { std::string name; double x, y, yaw, xy_tolerance, yaw_tolerance; };

double wrapped(double angle) { return std::remainder(angle, 2 * M_PI); }

Pose operator*(const Pose& a, const Pose& b) {  // b in the frame of a
    double c = std::cos(a.yaw), s = std::sin(a.yaw);
    return {a.x + c * b.x - s * b.y, a.y + s * b.x + c * b.y, a.yaw + b.yaw};
}

Pose inverse(const Pose& a) {
    double c = std::cos(a.yaw), s = std::sin(a.yaw);
    return {-c * a.x - s * a.y, s * a.x - c * a.y, -a.yaw};
}

Goal goal_of(const Json& json) {
    return {json["name"].text, json["x"].number, json["y"].number, json["yaw"].number,
            json["xy_tolerance"].number, json["yaw_tolerance"].number};
}

class GapFollower {
  public:
    double top_speed = 0.3, turn_rate = 1.0, radius = 0.25;
    Pose map_from_odom{0, 0, 0}, odom{0, 0, 0};
    std::vector<Goal> goals;
    bool active = false;
    double vx = 0, wz = 0;
    std::vector<std::string> events;

    void on_scan(Reader scan) {
        scan.header();
        first_ = scan.take<float>();
        scan.take<float>();
        step_ = scan.take<float>();
        for (int skipped = 0; skipped < 2; ++skipped) scan.take<float>();
        float least = scan.take<float>(), most = scan.take<float>();
        ranges_.resize(scan.take<uint32_t>());
        for (double& range : ranges_) {
            float value = scan.take<float>();
            range = value >= least && value <= most ? value : std::isnan(value) || value < least ? 0.0 : most;
        }
    }

    void on_odometry(Reader message) {
        message.header();
        message.skip_string();
        double n[7];
        for (double& value : n) value = message.take<double>();
        odom = {n[0], n[1], std::atan2(2 * (n[6] * n[5] + n[3] * n[4]), 1 - 2 * (n[4] * n[4] + n[5] * n[5]))};
    }

    void drop(bool all) {
        if (!goals.empty() && active) {
            report("goal.canceled", goals.front().name);
            goals.erase(goals.begin());
        }
        active = false;
        if (all) goals.clear();
    }

    void decide() {
        vx = wz = 0;
        if (goals.empty()) return;
        const Goal& goal = goals.front();
        if (!active) report("goal.accepted", goal.name);
        active = true;
        Pose pose = map_from_odom * odom;
        double dx = goal.x - pose.x, dy = goal.y - pose.y, distance = std::hypot(dx, dy);
        if (distance < 0.6 * goal.xy_tolerance) {
            double off = wrapped(goal.yaw - pose.yaw);
            if (std::abs(off) > 0.6 * goal.yaw_tolerance) {
                wz = std::copysign(std::min(turn_rate, std::max(0.2, std::abs(off))), off);
                return;
            }
            report("goal.reached", goal.name);
            goals.erase(goals.begin());
            active = false;
            return;
        }
        steer(wrapped(std::atan2(dy, dx) - pose.yaw), distance);
    }

  private:
    double first_ = 0, step_ = 0;
    std::vector<double> ranges_;

    void report(const std::string& kind, const std::string& name) {
        events.push_back("{\"kind\":\"" + kind + "\",\"name\":\"" + name + "\"}");
    }

    // Returns how far a robot of this width can drive in a direction, at most `limit`.
    double free_distance(double direction, double limit) const {
        double distance = limit;
        for (size_t k = 0; k < ranges_.size(); ++k) {
            double off = wrapped(first_ + step_ * k - direction), aside = std::abs(ranges_[k] * std::sin(off));
            if (std::abs(off) < M_PI / 2 && aside < radius + 0.08)
                distance = std::min(distance, ranges_[k] * std::cos(off) - radius - 0.08);
        }
        return distance;
    }

    void steer(double bearing, double distance) {
        if (ranges_.empty()) return;
        double best = bearing, best_cost = INFINITY, look = std::min(distance, 1.5);
        for (int k = -36; k <= 36; ++k) {
            double direction = k * M_PI / 36;
            double blocked = look - std::max(0.0, free_distance(direction, look));
            double cost = std::abs(wrapped(direction - bearing)) + 0.3 * std::abs(direction) + 8 * blocked;
            if (cost < best_cost) best = direction, best_cost = cost;
        }
        if (free_distance(bearing, look) >= look) best = bearing;
        wz = std::clamp(1.5 * best, -turn_rate, turn_rate);
        double ahead = std::max(0.0, free_distance(0.0, 1.5));
        vx = std::abs(best) > 0.8 ? 0.0 : std::min({top_speed, 0.5 * ahead, 0.5 * distance + 0.05});
    }
};

int main() try {
    const char* descriptor = std::getenv("SIMSCEN_STACK_FD");
    if (!descriptor) throw std::runtime_error("SIMSCEN_STACK_FD is not set: start this program with `simscen run --stack`");
    Socket simscen{std::atoi(descriptor)};
    Bytes body;

    simscen.receive(body);
    const Json hello = parsed(body);
    std::map<uint32_t, std::string> received_topics;
    std::map<std::string, uint32_t> sent_topics;
    for (const Json& topic : hello["says"].items) received_topics[topic["number"].number] = topic["topic"].text;
    for (const Json& topic : hello["hears"].items) sent_topics[topic["topic"].text] = topic["number"].number;
    GapFollower navigator;
    navigator.top_speed = std::min(0.3, hello["robot"]["max_linear"].number);
    navigator.turn_rate = std::min(1.0, hello["robot"]["max_angular"].number);
    navigator.radius = 0;
    for (const Json& corner : hello["robot"]["footprint"].items)
        navigator.radius = std::max(navigator.radius, std::hypot(corner.items[0].number, corner.items[1].number));
    simscen.send(WELCOME, R"({"protocol":1,"name":"gap follower","version":"1.0","topics":["/scan","/odom"]})");

    for (;;) {
        switch (simscen.receive(body)) {
            case GOAL: {
                const Json task = parsed(body);
                for (const Json& goal : task["goals"].items) navigator.goals.push_back(goal_of(goal));
                const Json& pose = task["initial_estimate"]["pose"];
                if (pose.items.size() == 3)
                    navigator.map_from_odom = {pose.items[0].number, pose.items[1].number, pose.items[2].number};
                break;
            }
            case PREEMPT:
                navigator.drop(false);
                navigator.goals.insert(navigator.goals.begin(), goal_of(parsed(body)["goal"]));
                break;
            case CANCEL:
                navigator.drop(parsed(body)["all"].truth);
                break;
            case STEP: {
                uint64_t tick;
                uint32_t flags, count, number, size;
                int32_t sec;
                uint32_t nanosec;
                std::memcpy(&tick, &body[0], 8);
                std::memcpy(&sec, &body[8], 4);
                std::memcpy(&nanosec, &body[12], 4);
                std::memcpy(&flags, &body[20], 4);
                std::memcpy(&count, &body[24], 4);
                for (size_t at = 28; count > 0; --count, at += size) {
                    std::memcpy(&number, &body[at], 4);
                    std::memcpy(&size, &body[at + 4], 4);
                    at += 8;
                    if (received_topics[number] == "/scan") navigator.on_scan({&body[at]});
                    if (received_topics[number] == "/odom") navigator.on_odometry({&body[at]});
                }
                navigator.decide();

                std::vector<std::pair<std::string, Bytes>> said;
                Writer command;
                for (double value : {navigator.vx, 0.0, 0.0, 0.0, 0.0, navigator.wz}) command.put(value);
                said.emplace_back("/cmd_vel", command.bytes);
                for (const std::string& event : navigator.events)
                    said.emplace_back("/simscen/events", Writer().string(event).bytes);
                navigator.events.clear();
                Pose pose = navigator.map_from_odom * navigator.odom;
                Writer belief;
                belief.put(sec).put(nanosec).string("map").put(pose.x).put(pose.y).put(0.0);
                belief.put(0.0).put(0.0).put(std::sin(pose.yaw / 2)).put(std::cos(pose.yaw / 2));
                for (int k = 0; k < 36; ++k) belief.put(k % 7 == 0 ? 0.01 : 0.0);
                said.emplace_back("/amcl_pose", belief.bytes);

                Writer answer;
                answer.bytes.clear();
                uint32_t messages = said.size();
                answer.raw(&tick, 8);
                answer.raw(&messages, 4);
                for (const auto& [topic, data] : said) {
                    uint32_t length = data.size();
                    answer.raw(&sent_topics.at(topic), 4);
                    answer.raw(&length, 4);
                    answer.raw(data.data(), data.size());
                }
                simscen.send(ANSWER, answer.bytes);
                break;
            }
            case END:
                simscen.send(BYE, std::string("{}"));
                return 0;
        }
    }
} catch (const std::exception& error) {
    std::cerr << "gap_follower: " << error.what() << '\n';
    return 1;
}
