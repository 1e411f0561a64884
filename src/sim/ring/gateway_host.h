// The host program of a gateway between a ring and an EtherCAT master, on its board.
#pragma once

#include "board/board.h"

extern "C" {
#include "node/ring_gateway.h"
#include "ring-gateway.h"
}

class RingGatewayHost : public FirmwareHost {
 public:
  RingGatewayHost(BoardHardware& hardware, const ring_node_parameters& parameters)
      : FirmwareHost(hardware, Passes::areTold),
        parameters_(parameters) {}
  ~RingGatewayHost() override { stop(); }

  const gateway& state() const { return gateway_; }

 protected:
  void run() override {
    constexpr uint32_t kPassUs = 1000;
    boot();
    gateway_start(&gateway_, &board_, &ring_, &parameters_);
    for (;;) {
      gateway_wait(&gateway_, kPassUs);
      endPass();
      gateway_serve(&gateway_);
    }
  }

 private:
  ring_node_parameters parameters_;
  board ring_{this, ESC_RING_SPACE};
  gateway gateway_{};
};
