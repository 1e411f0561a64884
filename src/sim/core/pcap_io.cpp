#include "core/pcap_io.h"

#include <pcap/pcap.h>

#include "core/flush.h"
#include "core/user_error.h"

std::vector<RecordedFrame> readCapture(const std::string& path) {
  char error[PCAP_ERRBUF_SIZE];
  std::unique_ptr<pcap_t, decltype(&pcap_close)> file(
      pcap_open_offline_with_tstamp_precision(path.c_str(), PCAP_TSTAMP_PRECISION_NANO, error), pcap_close);
  if (!file) throw UserError("cannot read the capture '" + path + "': " + error + ".");
  if (pcap_datalink(file.get()) != DLT_EN10MB)
    throw UserError("the capture '" + path + "' does not hold Ethernet frames.");
  std::vector<RecordedFrame> frames;
  pcap_pkthdr* header;
  const u_char* data;
  int result;
  while ((result = pcap_next_ex(file.get(), &header, &data)) == 1) {
    if (header->caplen < header->len)
      throw UserError("frame " + std::to_string(frames.size() + 1) + " of the capture '" + path +
                      "' was recorded cut off.");
    // With nanosecond precision libpcap keeps nanoseconds in tv_usec.
    frames.push_back(
        {header->ts.tv_sec * 1'000'000'000LL + header->ts.tv_usec, Bytes(data, data + header->caplen)});
  }
  if (result == PCAP_ERROR)
    throw UserError("the capture '" + path + "' is damaged: " + pcap_geterr(file.get()) + ".");
  return frames;
}

struct CaptureWriter::Handles {
  pcap_t* pcap = nullptr;
  pcap_dumper_t* dumper = nullptr;
  ~Handles() {
    if (dumper) pcap_dump_close(dumper);
    if (pcap) pcap_close(pcap);
  }
};

CaptureWriter::CaptureWriter(const std::string& path, int linkType)
    : path_(path),
      handles_(std::make_unique<Handles>()) {
  handles_->pcap = pcap_open_dead_with_tstamp_precision(linkType, 65535, PCAP_TSTAMP_PRECISION_NANO);
  handles_->dumper = pcap_dump_open(handles_->pcap, path.c_str());
  if (!handles_->dumper)
    throw UserError("cannot write the capture '" + path + "': " + pcap_geterr(handles_->pcap) + ".");
  flush();
}

CaptureWriter::~CaptureWriter() = default;

void CaptureWriter::flush() { ::flush(pcap_dump_file(handles_->dumper), "the capture '" + path_ + "'"); }

void CaptureWriter::write(int64_t ns, const Bytes& frame) {
  pcap_pkthdr header{};
  header.ts.tv_sec = ns / 1'000'000'000;
  header.ts.tv_usec = ns % 1'000'000'000;
  header.caplen = header.len = static_cast<bpf_u_int32>(frame.size());
  pcap_dump(reinterpret_cast<u_char*>(handles_->dumper), &header, frame.data());
  flush();
}
