#include "ring/recorder.h"

#include "core/flush.h"
#include "core/user_error.h"
#include "ring/socketcan.h"
#include "ring/socketcand.h"

namespace {
constexpr int kSocketCan = 227;  // link type
}

PcapRecorder::PcapRecorder(const std::string& path) : file_(path, kSocketCan) {}

// Identifier, big endian; length; no flags of CAN FD, a reserved byte, the DLC above 8; data.
void PcapRecorder::happened(const CanEvent& e) {
  const auto f = socketcan::of(e);
  if (!f) return;
  Bytes packet;
  for (int shift = 24; shift >= 0; shift -= 8) packet.push_back(static_cast<uint8_t>(f->id >> shift));
  packet.insert(packet.end(), {f->length, 0, 0, f->rawDlc});
  packet.insert(packet.end(), f->data.begin(), f->data.end());
  file_.write(e.at / kNs, packet);
}

CandumpRecorder::CandumpRecorder(const std::string& path)
    : path_(path),
      file_(std::fopen(path.c_str(), "w")) {
  if (!file_) throw UserError("cannot write the log '" + path + "'.");
}

CandumpRecorder::~CandumpRecorder() { std::fclose(file_); }

void CandumpRecorder::happened(const CanEvent& e) {
  const auto f = socketcan::of(e);
  if (!f) return;
  const Time us = e.at / kUs;
  const bool isLong = f->id & (socketcan::kExtended | socketcan::kError);
  std::fprintf(file_, "(%010lld.%06lld) %s ", static_cast<long long>(us / 1'000'000),
               static_cast<long long>(us % 1'000'000), SocketcandDoor::kBus);
  std::fprintf(file_, isLong ? "%08X#" : "%03X#",
               f->id & (f->id & socketcan::kError ? 0x3fffffffu : 0x1fffffffu));
  if (f->id & socketcan::kRemote) {
    std::fputc('R', file_);
    if (f->length > 0) std::fprintf(file_, "%u", f->length);
  } else {
    for (size_t i = 0; i < f->length; ++i) std::fprintf(file_, "%02X", f->data[i]);
  }
  if (f->rawDlc > 0) std::fprintf(file_, "_%X", f->rawDlc);
  std::fputc('\n', file_);
  flush(file_, "the log '" + path_ + "'");
}
