// The host program of a ring's gateway to the plant server, on its board.
#pragma once

#include "board/board.h"

extern "C" {
#include "node/ring_server.h"
}

class RingServerHost : public FirmwareHost {
 public:
  RingServerHost(BoardHardware& hardware, const ring_server_parameters& parameters)
      : FirmwareHost(hardware, Passes::areTold),
        parameters_(parameters) {}
  ~RingServerHost() override { stop(); }

  const ring_server& state() const { return server_; }

 protected:
  void run() override {
    constexpr uint32_t kPassUs = 1000;
    boot();
    ring_server_start(&server_, &board_, &parameters_);
    for (;;) {
      ring_server_wait(&server_, kPassUs);
      endPass();
      ring_server_serve(&server_);
    }
  }

 private:
  ring_server_parameters parameters_;
  ring_server server_{};
};
