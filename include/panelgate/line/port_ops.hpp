#pragma once

namespace panelgate::line {

/// Control requests to the driver of an open device. Tests replace it and replay recorded answers:
/// drivers differ in ways that a pseudo-terminal cannot show.
class PortOps {
  public:
    virtual ~PortOps() = default;
    /// Like ioctl(), but returns an error as the negative errno: -ENOTTY if the driver does not
    /// know the request.
    virtual int control(int fd, unsigned long request, void* argument) = 0;
};

/// Returns the operations of the running kernel.
PortOps& kernel_ops();

}  // namespace panelgate::line
