#pragma once

#include <string>

#include "tools/usb_device/hand_over.h"

namespace usb_device {

/// The device as a function of this machine's own USB device port: serves the functionfs mounted at
/// `folder` until SIGINT or SIGTERM, and says on stdout when a controller may be bound to the
/// gadget and what came of it. Call it before there are threads. Throws std::runtime_error.
void run_gadget(const std::string& folder, const HandOverSpec& spec);

}  // namespace usb_device
