#pragma once

namespace panelgate::line {

/// What is asked of the driver of an open device: the kernel seam. Drivers differ in what they can
/// do; with their answers recorded in a table, tests reach what a pseudo-terminal cannot show.
class PortOps {
  public:
    virtual ~PortOps() = default;
    /// As ioctl(), but an error is returned as the negative errno: -ENOTTY from a driver that does
    /// not know the request.
    virtual int control(int fd, unsigned long request, void* argument) = 0;
};

/// The running kernel's.
PortOps& kernel_ops();

}  // namespace panelgate::line
