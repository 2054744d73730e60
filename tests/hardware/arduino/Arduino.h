// As much of Arduino as the bridge's sketch needs, on two terminals of this computer: computer's side, servos' side.
// Its time goes by SLOWNESS times slower, because this computer answers later than servos do.
#pragma once
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#define HIGH 1
#define LOW 0
#define OUTPUT 1
#define constrain(value, least, most) ((value) < (least) ? (least) : (value) > (most) ? (most) : (value))

inline uint32_t micros() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint32_t)((now.tv_sec * 1000000ULL + now.tv_nsec / 1000) / SLOWNESS);
}
inline uint32_t millis() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint32_t)((now.tv_sec * 1000ULL + now.tv_nsec / 1000000) / SLOWNESS);
}
inline void pinMode(int, int) {}
inline void digitalWrite(int, int) {}

class HardwareSerial {
 public:
  int fd = -1;
  void begin(long) {}
  void flush() {}
  int available() {
    int count = 0;
    ioctl(fd, FIONREAD, &count);
    if (!count) usleep(100);  // this computer has others to serve, too
    return count;
  }
  int read() {
    uint8_t byte = 0;
    return ::read(fd, &byte, 1) == 1 ? byte : -1;
  }
  size_t write(const uint8_t *data, size_t count) { return count ? ::write(fd, data, count) : 0; }
  size_t write(uint8_t byte) { return ::write(fd, &byte, 1); }
};
extern HardwareSerial Serial, Serial1;
