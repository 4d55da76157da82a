#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "drivers/usb_link.h"
#include "drivers/v4l2_link.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;

void line(const char* link, const std::string& state) {
  std::printf("%-10s %s\n", link, state.c_str());
}

bool loaded(const char* module) {
  std::error_code error;
  return fs::exists(fs::path("/sys/module") / module, error);
}

/// Whether the running kernel has a module of this name to load, as its own list says.
bool installed(const std::string& module) {
  std::ifstream release("/proc/sys/kernel/osrelease");
  std::string kernel;
  std::getline(release, kernel);
  for (const char* list : {"modules.dep", "modules.builtin"}) {
    std::ifstream file(fs::path("/lib/modules") / kernel / list);
    for (std::string entry; std::getline(file, entry);)
      if (entry.substr(0, entry.find(':')).find("/" + module + ".ko") != std::string::npos)
        return true;
  }
  return false;
}

void list_shm() {
  const std::string name = "/starloop-links-" + std::to_string(getpid());
  const int file = shm_open(name.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
  if (file < 0) {
    line("shm", std::string("no: ") + std::strerror(errno));
    return;
  }
  close(file);
  shm_unlink(name.c_str());
  line("shm", "yes: --set link.to=shm:NAME; examples in tools/examples");
}

void list_v4l2() {
  bool any = false;
  for (const drivers::V4l2Node& node : drivers::list_v4l2_nodes()) {
    if (!node.problem.empty()) {
      line("v4l2", "no: " + node.path + ": " + node.problem +
                       "; config/udev/70-starloop.rules lets the group video use it");
    } else if (node.output || node.loopback) {
      any = true;
      line("v4l2", "yes: " + node.path + " \"" + node.card + "\" (" + node.driver +
                       "): --set link.to=v4l2:" + node.path);
    }
  }
  if (any) return;
  if (loaded("v4l2loopback")) {
    line("v4l2", "no: v4l2loopback is loaded, and has no node that may be used");
  } else if (installed("v4l2loopback")) {
    line("v4l2",
         "no: sudo modprobe v4l2loopback card_label=starloop exclusive_caps=1 makes a node; "
         "config/modprobe.d/starloop.conf at every start");
  } else {
    line("v4l2",
         "no: this kernel has no v4l2loopback; sudo apt install v4l2loopback-dkms builds it");
  }
}

void list_usb() {
  bool any = false;
  try {
    for (const drivers::UsbFound& d : drivers::list_usb_devices()) {
      any = true;
      char text[64];
      std::snprintf(text, sizeof text, "bus %03d device %03d, %04x:%04x", d.bus, d.address,
                    d.vendor, d.product);
      char name[32];
      std::snprintf(name, sizeof name, "usb:%04x:%04x", d.vendor, d.product);
      if (d.problem.empty()) {
        line("usb", std::string("yes: ") + text + ": --set link.to=" + name);
      } else {
        line("usb", std::string("no: ") + text + ": " + d.problem +
                        "; config/udev/70-starloop.rules lets the user open it");
      }
    }
  } catch (const std::runtime_error& e) {
    line("usb", std::string("no: ") + e.what());
    return;
  }
  if (any) return;
  line("usb", "no: no device with the interface of drivers/usb_protocol.md is plugged in");
  // The device in software, which this kernel would attach.
  const bool can_attach = loaded("vhci_hcd") || installed("vhci-hcd");
  line("usb", can_attach ? "without the board: starloop_usb_device, sudo modprobe vhci-hcd, sudo "
                           "usbip attach -r HOST -b 1-1 (docs/links.md)"
                         : "without the board: this kernel has no vhci-hcd to attach "
                           "starloop_usb_device with");
}

}  // namespace

int list_links() {
  line("mock", "yes: inside the program, for the built-in tracker and for CI");
  line("file", "yes: --set link.to=file:FOLDER, a FITS file for each frame");
  list_shm();
  list_v4l2();
  list_usb();
  return kGood;
}

}  // namespace starloop
