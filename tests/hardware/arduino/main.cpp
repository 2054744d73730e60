#include "Arduino.h"
#include <cstdlib>

HardwareSerial Serial, Serial1;

#include SKETCH

int main(int, char **arguments) {
  Serial.fd = atoi(arguments[1]);
  Serial1.fd = open(arguments[2], O_RDWR | O_NOCTTY);
  setup();
  while (getppid() != 1) loop();
}
