// cannelloni, version 2, over UDP: CAN frames in datagrams between two stations (TL-01).
#pragma once

#include <string>

#include "core/ethernet.h"
#include "ring/door.h"

class CannelloniDoor : public Door {
 public:
  // `peer`: the port of the other station; 0: that of whoever has sent last.
  CannelloniDoor(uint16_t port, uint16_t peer);
  ~CannelloniDoor() override;
  void serve(CanHost* port) override;
  void happened(const CanEvent& event) override;
  std::string name() const override { return "cannelloni"; }
  // Datagrams that have not come, by their numbers.
  uint64_t gaps() const { return gaps_; }

 private:
  bool take(const uint8_t* datagram, size_t length, CanHost* port);
  void flush();

  int socket_;
  uint16_t peer_;
  bool learns_, heard_ = false;
  uint8_t sequence_ = 0, wanted_ = 0;
  uint16_t count_ = 0;
  Bytes frames_;  // that wait to be sent
  uint64_t gaps_ = 0;
};
