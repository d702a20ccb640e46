#include "panelgate/line/port_ops.hpp"

#include <sys/ioctl.h>

#include <cerrno>

namespace panelgate::line {
namespace {

class KernelOps final : public PortOps {
  public:
    int control(int fd, unsigned long request, void* argument) override {
        const int result = ::ioctl(fd, request, argument);
        return result < 0 ? -errno : result;
    }
};

}  // namespace

PortOps& kernel_ops() {
    static KernelOps ops;
    return ops;
}

}  // namespace panelgate::line
