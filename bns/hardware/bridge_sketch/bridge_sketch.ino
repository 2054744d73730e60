// Bridge between a computer and a chain of AX-12 servos on an Arduino Mega. docs/bridge.md describes the frames.
//
// Computer: USB (Serial), 115200 baud. Servos: Serial1 (pins 18, 19), 1 Mbaud, half duplex through a 74LS241 or the like;
// DIRECTION is high while the Arduino speaks. Servos carry the ids 1, 2, 3, ... from the yellow end.

#include <Arduino.h>

const uint8_t DIRECTION = 2;
const uint8_t MOST_SERVOS = 16;
const uint8_t VERSION = 4;
const uint32_t WATCHDOG_MS = 500, TORN_MS = 50, RAMP_MS = 50, OFF_MS = 20, ANSWER_US = 3000;

const uint8_t START = 0xA5, HELLO = 1, ARM = 2, MOVE = 3, STATE = 4, STOP = 5, ANSWER = 0x80, REFUSED = 0xFF;
const uint8_t NO_ANSWER = 0x80, RESTARTED = 0xC0;  // in a servo's error byte

// Control table of the AX-12.
const uint8_t ANGLE_LIMITS = 6, TORQUE_ENABLE = 24, GOAL = 30, TORQUE_LIMIT = 34, POSITION = 36;
// Instructions of its protocol. Beware of short names: those of the chip's registers (PING is port G's) are macros.
const uint8_t READ = 2, WRITE = 3, BROADCAST = 254;
const uint8_t RAMP_STEPS = 4, TRIES = 3, LONGEST_STATUS = 6 + 20;
const uint16_t OFF_TRIES = 3000;  // a minute: a servo that is deaf for longer has no power, or no cable

uint8_t frame[4 + 255 + 2], back[7 * MOST_SERVOS], servos = 0, ramp = RAMP_STEPS, grown = 0;
uint16_t held = 0, low[MOST_SERVOS], high[MOST_SERVOS], torque = 0;
uint16_t kept = 0, offTries = 0;  // a bit for each servo that has not said yet that its torque is off; how often it was told so
uint32_t heardMs = 0, byteMs = 0, rampMs = 0, offMs = 0;
bool armed = false;

uint16_t crc16(const uint8_t *data, uint16_t count) {
  uint16_t value = 0xFFFF;
  while (count--) {
    value ^= (uint16_t)*data++ << 8;
    for (uint8_t bit = 0; bit < 8; bit++) value = value & 0x8000 ? (value << 1) ^ 0x1021 : value << 1;
  }
  return value;
}

uint16_t word16(const uint8_t *bytes) { return bytes[0] | (uint16_t)bytes[1] << 8; }

// Takes what the computer has sent. The core keeps 63 bytes only, so this is done while servos are waited for, too.
void collect() {
  while (Serial.available() && held < sizeof frame) {
    frame[held++] = Serial.read();
    byteMs = millis();
  }
}

// ---- servos -------------------------------------------------------------------------------------------------------------

void say(uint8_t id, uint8_t instruction, const uint8_t *parameters, uint8_t count) {
  uint8_t sum = id + count + 2 + instruction;
  while (Serial1.available()) Serial1.read();
  digitalWrite(DIRECTION, HIGH);
  const uint8_t head[] = {0xFF, 0xFF, id, (uint8_t)(count + 2), instruction};
  Serial1.write(head, sizeof head);
  for (uint8_t i = 0; i < count; i++) sum += parameters[i];
  Serial1.write(parameters, count);
  Serial1.write((uint8_t)~sum);
  Serial1.flush();
  digitalWrite(DIRECTION, LOW);
}

// Whether these bytes are a whole, good status packet of that servo.
bool isStatus(const uint8_t *packet, uint8_t size, uint8_t id) {
  if (packet[0] != 0xFF || packet[1] != 0xFF || packet[2] != id || packet[3] != size - 4) return false;
  uint8_t sum = 0;
  for (uint8_t i = 2; i < size; i++) sum += packet[i];
  return sum == 0xFF;
}

// A status packet with so many parameters; its error byte, or -1 if none came. Bytes before it are passed over: when the bus
// is turned round, its line may jump, and a stray byte, an FF as well as any other, stands before the packet.
int hear(uint8_t id, uint8_t *parameters, uint8_t count) {
  uint8_t packet[LONGEST_STATUS], got = 0;
  const uint8_t size = count + 6;
  for (uint32_t began = micros(); micros() - began < ANSWER_US;) {
    collect();
    if (!Serial1.available()) continue;
    if (got == size) memmove(packet, packet + 1, --got);
    packet[got++] = Serial1.read();
    if (got < size || !isStatus(packet, size, id)) continue;
    for (uint8_t i = 0; i < count; i++) parameters[i] = packet[5 + i];
    return packet[4];
  }
  return -1;
}

int asked(uint8_t id, uint8_t instruction, const uint8_t *sent, uint8_t sentCount, uint8_t *back, uint8_t backCount) {
  for (uint8_t i = 0; i < TRIES; i++) {
    say(id, instruction, sent, sentCount);
    int error = hear(id, back, backCount);
    if (error >= 0) return error;
  }
  return -1;
}

int readTable(uint8_t id, uint8_t address, uint8_t *back, uint8_t count) {
  const uint8_t what[] = {address, count};
  return asked(id, READ, what, 2, back, count);
}

bool write8(uint8_t id, uint8_t address, uint8_t value) {
  const uint8_t what[] = {address, value};
  return asked(id, WRITE, what, 2, 0, 0) >= 0;
}

bool write16(uint8_t id, uint8_t address, uint16_t value) {
  const uint8_t what[] = {address, (uint8_t)value, (uint8_t)(value >> 8)};
  return asked(id, WRITE, what, 3, 0, 0) >= 0;
}

bool writeGoal(uint8_t id, uint16_t goal, uint16_t speed) {
  const uint8_t what[] = {GOAL, (uint8_t)goal, (uint8_t)(goal >> 8), (uint8_t)speed, (uint8_t)(speed >> 8)};
  return asked(id, WRITE, what, 5, 0, 0) >= 0;
}

void scan() {
  uint8_t limits[4];
  for (servos = 0; servos < MOST_SERVOS && readTable(servos + 1, ANGLE_LIMITS, limits, 4) >= 0; servos++) {
    low[servos] = word16(limits);
    high[servos] = word16(limits + 2);
  }
}

// Torque off. Into `back`: a bit for each servo that does not say that it is off, and where the servos are (0: not read).
void stopAll() {
  const uint8_t off[] = {TORQUE_ENABLE, 0};
  uint16_t left = 0;
  armed = false;
  ramp = RAMP_STEPS;
  say(BROADCAST, WRITE, off, 2);
  for (uint8_t i = 0; i < servos; i++) {
    uint8_t now[POSITION + 2 - TORQUE_ENABLE] = {0};  // one question for both: torque first, position last
    bool good = readTable(i + 1, TORQUE_ENABLE, now, sizeof now) >= 0;
    if (good && now[0]) write8(i + 1, TORQUE_ENABLE, 0);  // it did not hear the order to all; read back the next time
    if (!good || now[0]) left |= (uint16_t)1 << i;
    memcpy(back + 2 + 2 * i, now + sizeof now - 2, 2);
  }
  back[0] = left;
  back[1] = left >> 8;
  kept = left;
  offTries = 0;
}

// A stop does not end with one attempt: a servo may have been deaf just then, and a computer that is gone does not repeat it.
// So each servo that has not said that its torque is off is told again until it does, or OFF_TRIES times in all. One servo
// each time, asked once, and a pause of OFF_MS, so that frames of the computer are answered in between.
void repeatStop() {
  static uint8_t last = 0;
  if (!kept || millis() - offMs < OFF_MS) return;
  offMs = millis();
  if (offTries++ == OFF_TRIES) {
    kept = 0;
    return;
  }
  do last = (last + 1) % MOST_SERVOS;
  while (!(kept & (uint16_t)1 << last));
  const uint8_t off[] = {TORQUE_ENABLE, 0}, what[] = {TORQUE_ENABLE, 1};
  uint8_t now = 1;
  say(last + 1, WRITE, off, 2);
  hear(last + 1, 0, 0);
  say(last + 1, READ, what, 2);
  if (hear(last + 1, &now, 1) >= 0 && !now) kept &= ~((uint16_t)1 << last);
}

// Torque grows in steps, so that nothing jerks; goals are where the joints are.
bool arm(uint8_t percent) {
  for (uint8_t i = 0; i < servos; i++) {
    uint8_t here[2];
    bool good = readTable(i + 1, POSITION, here, 2) >= 0 && write16(i + 1, TORQUE_LIMIT, 0);
    if (!good || !writeGoal(i + 1, word16(here), 1)) return false;
  }
  torque = (uint32_t)1023 * percent / 100;
  kept = 0;
  ramp = grown = 0;
  armed = true;
  return true;
}

// One servo each time, so that an order to stop waits for no more than that.
void grow() {
  if (!armed || ramp >= RAMP_STEPS) return;
  if (grown == 0) {
    if (ramp && millis() - rampMs < RAMP_MS) return;
    rampMs = millis();
  }
  if (grown < servos) {
    write16(grown + 1, TORQUE_LIMIT, (uint32_t)torque * (ramp + 1) / RAMP_STEPS);
    write8(grown + 1, TORQUE_ENABLE, 1);
    grown++;
  }
  if (grown < servos) return;
  grown = 0;
  ramp++;
}

// ---- frames -------------------------------------------------------------------------------------------------------------

void answer(uint8_t kind, uint8_t sequence, const uint8_t *payload, uint8_t count) {
  static uint8_t out[4 + 255 + 2];
  out[0] = START;
  out[1] = count;
  out[2] = kind;
  out[3] = sequence;
  for (uint8_t i = 0; i < count; i++) out[4 + i] = payload[i];
  const uint16_t crc = crc16(out + 1, 3 + count);
  out[4 + count] = crc;
  out[5 + count] = crc >> 8;
  Serial.write(out, 6 + count);
}

void hello(uint8_t sequence) {
  uint8_t who[2 + 4 * MOST_SERVOS] = {VERSION, servos};
  for (uint8_t i = 0; i < servos; i++) {
    const uint8_t limits[] = {(uint8_t)low[i], (uint8_t)(low[i] >> 8), (uint8_t)high[i], (uint8_t)(high[i] >> 8)};
    memcpy(who + 2 + 4 * i, limits, 4);
  }
  answer(HELLO | ANSWER, sequence, who, 2 + 4 * servos);
}

// Answers a question; false if it makes no sense or a servo did not take it.
bool understood(uint8_t kind, uint8_t sequence, uint8_t *payload, uint8_t count) {
  if (kind == HELLO && count == 0) {
    if (!armed) scan();
    hello(sequence);
  } else if (kind == ARM && count == 1 && payload[0] <= 100) {
    if (!arm(payload[0])) return false;
    answer(kind | ANSWER, sequence, back, 0);
  } else if (kind == MOVE && count == 4 * servos && armed) {
    for (uint8_t i = 0; i < servos; i++) {
      const uint16_t goal = constrain(word16(payload + 4 * i), low[i], high[i]);
      const uint16_t speed = constrain(word16(payload + 4 * i + 2), 1, 1023);
      if (!writeGoal(i + 1, goal, speed)) return false;
      const uint8_t set[] = {(uint8_t)goal, (uint8_t)(goal >> 8), (uint8_t)speed, (uint8_t)(speed >> 8)};
      memcpy(payload + 4 * i, set, 4);
    }
    answer(kind | ANSWER, sequence, payload, count);
  } else if (kind == STATE && count == 0) {
    for (uint8_t i = 0; i < servos; i++) {
      uint8_t all[POSITION + 8 - TORQUE_ENABLE] = {0};  // torque first; last position, speed, load, voltage, temperature
      const uint8_t *now = all + POSITION - TORQUE_ENABLE;
      int error = readTable(i + 1, TORQUE_ENABLE, all, sizeof all);
      // A servo that restarts has its torque off, or on again with the next goal, and the highest limit that it allows.
      const bool kept = all[0] && word16(all + TORQUE_LIMIT - TORQUE_ENABLE) == torque;
      if (error == 0 && armed && ramp >= RAMP_STEPS && !kept) error = RESTARTED;
      const uint8_t told[] = {now[0], now[1], now[4], now[5], now[7], now[6], error < 0 ? NO_ANSWER : (uint8_t)error};
      memcpy(back + 7 * i, told, 7);
    }
    answer(kind | ANSWER, sequence, back, 7 * servos);
  } else if (kind == STOP && count == 0) {
    stopAll();
    answer(kind | ANSWER, sequence, back, 2 + 2 * servos);
  } else {
    return false;
  }
  return true;
}

void drop(uint16_t count) {
  held -= count;
  memmove(frame, frame + count, held);
}

// Takes whole, good frames out of what has come; bytes before a start byte and starts with a wrong checksum are passed over.
void listen() {
  collect();
  if (held && millis() - byteMs > TORN_MS) drop(1);  // its rest does not come any more
  while (held) {
    const uint16_t whole = held > 1 ? 6 + frame[1] : 6;
    if (frame[0] != START) {
      drop(1);
    } else if (held < whole) {
      return;
    } else if (crc16(frame + 1, whole - 3) != word16(frame + whole - 2)) {
      drop(1);
    } else {
      heardMs = millis();
      if (!understood(frame[2], frame[3], frame + 4, frame[1])) answer(REFUSED, frame[3], frame, 0);
      drop(whole);
    }
  }
}

void setup() {
  pinMode(DIRECTION, OUTPUT);
  digitalWrite(DIRECTION, LOW);
  Serial.begin(115200);
  Serial1.begin(1000000);
  scan();
  stopAll();  // whatever was on before this start
  hello(0);   // unasked: the computer keeps silent until then, because a byte would hold up the boot loader
}

void loop() {
  listen();
  grow();
  repeatStop();
  if (armed && millis() - heardMs > WATCHDOG_MS) stopAll();
}
