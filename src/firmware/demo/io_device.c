#include "io_device.h"

/* The inputs of the demonstration follow its parameters; without valid outputs everything is off. */
static void cycle(void *context, bool outputs_valid) {
  struct io_device *io = context;
  struct slave_demo_objects *o = &io->device.objects;
  const bool on = outputs_valid && o->object_8000_06;
  const uint16_t outputs = on ? o->object_7000_01 & o->object_8000_02 : 0;
  io->board->drive(io->board->context, outputs, on && o->object_7000_02);
  o->object_6000_01 = io->board->sense(io->board->context) ^ o->object_8000_01;
  ++o->object_6001;
  const bool overloaded = (outputs & IO_OVERLOADED) != 0;
  o->object_1001 = overloaded ? IO_OVERLOAD_BIT : 0;
  if (overloaded == io->overloaded) return;
  /* With too many waiting, in a later cycle. */
  if (slave_emergency(&io->device.slave, overloaded ? IO_OVERLOAD : 0, o->object_1001, 0))
    io->overloaded = overloaded;
}

static bool is_firmware(const char *name, uint16_t length) {
  static const char expected[] = IO_FIRMWARE_NAME;
  if (length != sizeof expected - 1) return false;
  for (uint16_t i = 0; i < length; ++i)
    if (name[i] != expected[i]) return false;
  return true;
}

static uint32_t open_file(void *context, const char *name, uint16_t length, uint32_t password,
                          bool to_write) {
  struct io_device *io = context;
  (void)password;
  if (!is_firmware(name, length)) return FOE_NOT_FOUND;
  if (to_write && io->device.slave.state != AL_BOOT) return FOE_BOOT_ONLY;
  io->sum = 0;
  io->magic = io->version = 0;
  return to_write ? io->board->erase(io->board->context) : 0;
}

static uint32_t read_file(void *context, uint32_t offset, uint8_t *data, uint16_t most, uint16_t *length) {
  struct io_device *io = context;
  return io->board->fetch(io->board->context, offset, data, most, length);
}

static uint32_t write_file(void *context, uint32_t offset, const uint8_t *data, uint16_t length, bool last) {
  struct io_device *io = context;
  const uint32_t error = io->board->store(io->board->context, offset, data, length);
  if (error) return error;
  for (uint16_t i = 0; i < length; ++i) io->sum = (uint8_t)(io->sum + data[i]);
  if (offset == 0 && length >= IO_FIRMWARE_LEAST) {
    io->magic = number_at(data, 4);
    io->version = number_at(data + 4, 4);
  }
  return last && (io->sum != 0 || io->magic != IO_FIRMWARE_MAGIC) ? FOE_PROGRAM : 0;
}

static void close_file(void *context, bool complete) {
  struct io_device *io = context;
  if (complete && io->magic == IO_FIRMWARE_MAGIC) io->device.objects.object_2001 = io->version;
}

void io_device_start(struct io_device *io, struct board *board, const struct io_board *hardware) {
  *io = (struct io_device){
      .board = hardware,
      .application = {
          .context = io, .cycle = cycle, .files = {open_file, read_file, write_file, close_file}}};
  slave_demo_start(&io->device, board, &io->application);
}

void io_device_serve(struct io_device *io) { slave_serve(&io->device.slave); }
