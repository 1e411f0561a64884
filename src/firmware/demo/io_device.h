/* The demonstration of the slave stack: an I/O device with eight parameters, whose firmware a master renews
 * by FoE. It has 16 outputs, a lamp, 16 inputs, a temperature and a set point (src/base/resources/devices,
 * slave-demo.json). */
#ifndef FLYFRAME_IO_DEVICE_H
#define FLYFRAME_IO_DEVICE_H

#include "slave-demo.objects.h"

/* What the board of the device has. */
struct io_board {
  void *context; /* handed through */
  void (*drive)(void *context, uint16_t outputs, bool lamp);
  uint16_t (*sense)(void *context); /* inputs */
  /* Memory for the firmware: as in struct slave_files 0, SLAVE_FILE_BUSY or an error of FoE. Writing begins
   * behind `erase`, at offset 0, and goes on without gaps; fewer bytes than `most` are the last ones. */
  uint32_t (*erase)(void *context);
  uint32_t (*store)(void *context, uint32_t offset, const uint8_t *data, uint16_t length);
  uint32_t (*fetch)(void *context, uint32_t offset, uint8_t *data, uint16_t most, uint16_t *length);
};

/* A firmware: IO_FIRMWARE_MAGIC, its version (little endian, 4 bytes), anything, and in its last byte what
 * makes the sum of all bytes 0. */
#define IO_FIRMWARE_MAGIC 0x57464646u
#define IO_FIRMWARE_NAME "firmware.bin"
enum { IO_FIRMWARE_LEAST = 9 };

/* Emergencies: code and bit of the error register. */
enum { IO_OVERLOAD = 0x2310, IO_OVERLOAD_BIT = 0x02 };
enum { IO_OVERLOADED = 0x8000 }; /* the output that overloads the device */

struct io_device {
  struct slave_demo device;
  struct slave_application application;
  const struct io_board *board;
  bool overloaded;
  uint8_t sum;
  uint32_t magic, version; /* of what is being written */
};

void io_device_start(struct io_device *io, struct board *board, const struct io_board *hardware);
/* To be called again and again. */
void io_device_serve(struct io_device *io);

#endif
