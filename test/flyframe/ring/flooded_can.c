// Before a program (LD_PRELOAD) the kernel has one CAN interface, in which there always is another frame.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <linux/can.h>
#include <net/if.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static int interface = -1;

int socket(int family, int type, int protocol) {
  int (*real)(int, int, int) = (int (*)(int, int, int))dlsym(RTLD_NEXT, "socket");
  return family == PF_CAN ? (interface = dup(0)) : real(family, type, protocol);
}

int bind(int fd, const struct sockaddr *address, socklen_t size) {
  int (*real)(int, const struct sockaddr *, socklen_t) =
      (int (*)(int, const struct sockaddr *, socklen_t))dlsym(RTLD_NEXT, "bind");
  return fd == interface ? 0 : real(fd, address, size);
}

unsigned if_nametoindex(const char *name) { return name[0] != 0; }

ssize_t read(int fd, void *to, size_t size) {
  ssize_t (*real)(int, void *, size_t) = (ssize_t(*)(int, void *, size_t))dlsym(RTLD_NEXT, "read");
  if (fd != interface || size < sizeof(struct can_frame)) return real(fd, to, size);
  const struct can_frame frame = {.can_id = 0x123};
  memcpy(to, &frame, sizeof frame);
  return sizeof frame;
}
