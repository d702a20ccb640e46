#pragma once

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <asm/termios.h>  // neither with <termios.h>
#include <linux/serial.h>

#include <cerrno>
#include <cstring>
#include <functional>
#include <map>
#include <vector>

#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {

/// A scripted driver: answers each request as a test sets it, others as the kernel does for the pty
/// behind it, or -ENOTTY without a descriptor.
class ScriptedOps final : public PortOps {
  public:
    using Answer = std::function<int(void* argument)>;

    int control(int fd, unsigned long request, void* argument) override {
        asked.push_back(request);
        const auto answer = answers.find(request);
        if (answer != answers.end()) return answer->second(argument);
        return fd >= 0 ? kernel_ops().control(fd, request, argument) : -ENOTTY;
    }
    void refuse(unsigned long request, int error) {
        answers[request] = [error](void*) { return -error; };
    }
    /// Copies `value` into the caller's argument.
    template <class Value>
    void give(unsigned long request, Value value) {
        answers[request] = [value](void* argument) {
            std::memcpy(argument, &value, sizeof value);
            return 0;
        };
    }
    /// A driver that stores a value and returns it.
    template <class Value>
    void keep(unsigned long set, unsigned long get, Value& kept) {
        answers[set] = [&kept](void* argument) {
            std::memcpy(&kept, argument, sizeof kept);
            return 0;
        };
        answers[get] = [&kept](void* argument) {
            std::memcpy(argument, &kept, sizeof kept);
            return 0;
        };
    }

    std::map<unsigned long, Answer> answers;
    std::vector<unsigned long> asked;
};

}  // namespace panelgate::line
