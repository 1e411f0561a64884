package flyframe.registers

import RegisterTable._
import NetworkAddresses._

/** The registers of a ring node's port to the plant network (GW-04): datagrams to and from the server.
  * Addresses and UDP ports stand there as on the wire, first byte first.
  */
object PlantRegisters {
  val Control        = 0x0900
  val Status         = 0x0901
  val Command        = 0x0902
  val SendLength     = 0x0904
  val ReceivedLength = 0x0906
  val BadFrames      = 0x0908
  val Refused        = 0x0909
  val Dropped        = 0x090a

  /** Where [[NetworkAddresses]] begin to count. */
  val Settings = 0x0900

  /** Payload of the datagram to be sent, and of the oldest one received. */
  val SendData     = 0x1000
  val ReceivedData = 0x1800

  /** Bytes of either. */
  val DataBytes = 0x800

  /** Bytes of the longest payload. */
  val MostPayload = 1472

  // Bits of the command.
  val Send    = 0
  val Release = 1
  val Clear   = 2

  private def counter(address: Int, name: String, text: String) =
    register(address, 1, name, no, r, "GW-04", text, field(name, 7, 0, status, 0, s"$text, up to 255"))

  private def setting(place: Int, bytes: Int, name: String, text: String) =
    register(
      Settings + First + place,
      bytes,
      name,
      no,
      rw,
      "GW-04",
      text,
      field(name, 8 * bytes - 1, 0, ram, 0, text)
    )

  // format: off
  val all: Seq[Register] = Seq(
    register(Control,        1, "plant_control",         no, rw, "GW-04", "Control of the plant port",
      field("plant_run",             0, 0, stored, 0, "1: takes and answers frames; 0: hears none")),
    register(Status,         1, "plant_status",          no, r,  "GW-04", "State of the plant port",
      field("plant_link",            0, 0, status, 0, "1: link to the plant network"),
      field("plant_sending",         1, 1, status, 0, "1: a datagram is being sent"),
      field("plant_waiting",         2, 2, status, 0, "1: a datagram of the server waits")),
    register(Command,        1, "plant_command",         no, rw, "GW-04", "Command; reads 0",
      field("plant_send",         Send, Send, status, 0,
          "Write 1: sends the datagram, unless one is being sent"),
      field("plant_release",   Release, Release, status, 0, "Write 1: drops the oldest datagram received"),
      field("plant_clear",       Clear, Clear, status, 0, "Write 1: counters are cleared")),
    register(SendLength,     2, "plant_send_length",     no, rw, "GW-04", "Length of the datagram to be sent",
      field("plant_send_length",    10, 0, stored, 0, s"Bytes of payload, up to $MostPayload")),
    register(ReceivedLength, 2, "plant_received_length", no, r,  "GW-04", "Length of the datagram received",
      field("plant_received_length", 10, 0, status, 0, "Bytes of payload of the oldest one; 0: none waits")),
    counter(BadFrames, "plant_bad_frames", "Bad frames"),
    counter(Refused,   "plant_refused",    "Frames to this station that were no datagrams of the server"),
    counter(Dropped,   "plant_dropped",    "Datagrams of the server for which there was no place"),
    setting(ServerMac,  6, "plant_server_mac",  "MAC address of the server or of the router to it"),
    setting(MasterMac,  6, "plant_mac",         "MAC address of the node"),
    setting(MasterIp,   4, "plant_ip",          "IP address of the node"),
    setting(ServerIp,   4, "plant_server_ip",   "IP address of the server"),
    setting(MasterPort, 2, "plant_udp_port",    "UDP port of the node"),
    setting(ServerPort, 2, "plant_server_port", "UDP port of the server"),
    register(SendData,       4, "plant_send_data",       no, rw, "GW-04",
        s"Payload of the datagram to be sent, $DataBytes bytes from here on; reads 0",
      field("plant_send_data",      31, 0, status, 0, "Its first four bytes, the first one lowest")),
    register(ReceivedData,   4, "plant_received_data",   no, r,  "GW-04",
        s"Payload of the oldest datagram received, $DataBytes bytes from here on",
      field("plant_received_data",  31, 0, status, 0, "Its first four bytes, the first one lowest"))
  )
  // format: on
}
