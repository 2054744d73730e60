// An Arduino Mega 2560 in simavr: boot loader and sketch as they are on a board, moved on by whoever asks, over stdin and stdout.
//
// Asked:    'R' u64 cycles   run so long, or until the board has sent something and been quiet for a quarter of a millisecond
//           'H' u16 n, n bytes   the computer sends these, from now on, at 115200 baud
//           'S' u8             this byte gets onto the bus when the bus is next turned round
//           'X'                reset, as DTR does it when the port is opened
// Answers:  'B' u64 cycle, u8  a byte was written to the bus; wanted: u32 cycles, u16 n, n bytes (what comes back, how much later)
//           'D' u64 cycle, u32 faults, u16 n, n bytes   it has run; what the board said to the computer
//
// Faults of the half-duplex bus are counted: bytes sent against the direction pin, turned round before the last bit was out,
// received while it was the board's turn, or overrun. The chip's UART holds two bytes and a third as it comes in. That of simavr holds
// 64 and hands each out a byte's time after the last was read, which no chip does: so it is given one at a time, when it has come in.

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "avr_ioport.h"
#include "avr_uart.h"
#include "sim_avr.h"
#include "sim_elf.h"

DEFINE_FIFO(uint16_t, uart_fifo);

enum { HZ = 16000000, HOST_BYTE = HZ / 11520, BUS_BYTE = HZ / 100000, QUIET = HZ / 4000, BOOT_BASE = 0x3E000, BOOT_SIZE = 0x2000, ROOM = 1 << 16, CHIP_HOLDS = 3 };

typedef struct {
  uint8_t bytes[ROOM];
  unsigned head, tail;
} queue_t;

static FILE *answers;
static avr_t *avr;
static avr_uart_t *uart[2];
static avr_irq_t *input[2];
static queue_t to_board, come[2];
static struct {
  uint64_t at;
  uint8_t byte;
} due[ROOM];  // what servos will have sent by then, soonest first: a late answer is on its way while the next question goes out
static unsigned due_count;
static uint8_t said[ROOM];
static unsigned said_count;
static uint64_t said_at, bus_free_at;
enum { MUTE, CUT, TALKED_OVER, OVERRUN };  // each has a byte of these
static uint32_t faults;
static int board_speaks, speaking, stray = -1;  // to servos; to the computer

static void take(void *into, size_t count) {
  if (fread(into, 1, count, stdin) != count) exit(0);  // whoever asked is gone
}

static void give(const void *from, size_t count) {
  if (fwrite(from, 1, count, answers) != count) exit(0);
}

static void fault(int kind) { faults += 1u << 8 * kind; }

static void hand_over(int number) {
  const avr_cycle_count_t byte_time = uart[number]->cycles_per_byte;
  if (come[number].head == come[number].tail || !uart_fifo_isempty(&uart[number]->input)) return;
  uart[number]->cycles_per_byte = 1;
  avr_raise_irq(input[number], come[number].bytes[come[number].tail++ % ROOM]);
  uart[number]->cycles_per_byte = byte_time;
}

// A byte has come in, its stop bit too.
static void deliver(int number, uint8_t byte) {
  const unsigned waiting = come[number].head - come[number].tail + !uart_fifo_isempty(&uart[number]->input);
  if (waiting >= CHIP_HOLDS)
    fault(OVERRUN);
  else
    come[number].bytes[come[number].head++ % ROOM] = byte;
  hand_over(number);
}

static avr_cycle_count_t next_from_host(avr_t *board, avr_cycle_count_t when, void *param) {
  (void)board, (void)param;
  if (to_board.head == to_board.tail) return 0;
  deliver(0, to_board.bytes[to_board.tail++ % ROOM]);
  return to_board.head == to_board.tail ? 0 : when + HOST_BYTE;
}

static void send_at(uint64_t at, uint8_t byte) {
  unsigned place = due_count++;
  if (due_count == ROOM) exit(6);
  for (; place && due[place - 1].at > at; place--) due[place] = due[place - 1];
  due[place].at = at;
  due[place].byte = byte;
}

// Servos that send at the same time pull the line down for each other.
static avr_cycle_count_t next_from_bus(avr_t *board, avr_cycle_count_t when, void *param) {
  (void)board, (void)param;
  const uint64_t at = due[0].at;
  uint8_t byte = 0xFF;
  unsigned taken = 0;
  for (; taken < due_count && due[taken].at < at + BUS_BYTE; taken++) byte &= due[taken].byte;
  memmove(due, due + taken, (due_count -= taken) * sizeof *due);
  if (board_speaks)
    fault(TALKED_OVER);
  else
    deliver(1, byte);
  return !due_count ? 0 : due[0].at > when ? due[0].at : when + 1;
}

static void said_to_host(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  said[said_count++ % ROOM] = value;
  said_at = avr->cycle;
  speaking = 1;
}

static void written_to_bus(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  const uint8_t kind = 'B', byte = value;
  const uint64_t now = avr->cycle;
  uint32_t later;
  uint16_t count;
  bus_free_at = (bus_free_at > now ? bus_free_at : now) + BUS_BYTE;
  if (!board_speaks) {
    fault(MUTE);
    return;
  }
  give(&kind, 1), give(&now, 8), give(&byte, 1), fflush(answers);
  take(&later, 4), take(&count, 2);
  for (uint16_t i = 0; i < count; i++) {
    uint8_t answer;
    take(&answer, 1);
    send_at(bus_free_at + later + (i + 1) * BUS_BYTE, answer);
  }
  if (count) avr_cycle_timer_register(avr, due[0].at > now ? due[0].at - now : 1, next_from_bus, NULL);
}

static void turned_round(struct avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  if (board_speaks && !value) {
    if (avr->cycle + BUS_BYTE / 10 < bus_free_at) fault(CUT);  // the last byte's stop bit may be cut short, no more
    if (stray >= 0) deliver(1, stray);
    stray = -1;
  }
  board_speaks = value;
}

static void run_for(uint64_t cycles) {
  const uint64_t end = avr->cycle + cycles;
  said_count = 0;
  while (avr->cycle < end && !(speaking && avr->cycle > said_at + QUIET)) {
    const int state = avr_run(avr);
    hand_over(0), hand_over(1);
    if (state == cpu_Done || state == cpu_Crashed) exit(3);
  }
  if (avr->cycle > said_at + QUIET) speaking = 0;
  const uint8_t kind = 'D';
  const uint64_t now = avr->cycle;
  const uint16_t count = said_count;
  give(&kind, 1), give(&now, 8), give(&faults, 4), give(&count, 2), give(said, count), fflush(answers);
}

static void connect_uart(int number, avr_irq_notify_t out) {
  const uint32_t none = 0;
  const char name = '0' + number;
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(name), (void *)&none);  // it would sleep in real time while the chip polls
  input[number] = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(name), UART_IRQ_INPUT);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(name), UART_IRQ_OUTPUT), out, NULL);
  for (avr_io_t *io = avr->io_port; io; io = io->next)
    if (io->kind && !strcmp(io->kind, "uart") && ((avr_uart_t *)io)->name == name) uart[number] = (avr_uart_t *)io;
  if (!uart[number]) exit(4);
}

static void load(const char *sketch, const char *boot_loader) {
  static elf_firmware_t firmware;
  static uint8_t boot[BOOT_SIZE];
  FILE *file = fopen(boot_loader, "rb");
  if (!file || elf_read_firmware(sketch, &firmware)) exit(5);
  firmware.frequency = HZ;
  avr_load_firmware(avr, &firmware);
  avr_loadcode(avr, boot, fread(boot, 1, sizeof boot, file), BOOT_BASE);
  fclose(file);
  avr->codeend = avr->flashend;
  avr->reset_pc = BOOT_BASE;  // the fuses of a Mega 2560: BOOTRST, 8 KiB
}

int main(int count, char **arguments) {
  if (count != 3 || !(avr = avr_make_mcu_by_name("atmega2560"))) return 2;
  answers = fdopen(dup(1), "wb");
  dup2(2, 1);  // the library prints on stdout
  avr_init(avr);
  avr->frequency = HZ;
  avr->log = LOG_NONE;
  load(arguments[1], arguments[2]);
  connect_uart(0, said_to_host);
  connect_uart(1, written_to_bus);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('E'), 4), turned_round, NULL);  // digital pin 2
  avr_reset(avr);
  for (uint8_t asked;;) {
    take(&asked, 1);
    if (asked == 'R') {
      uint64_t cycles;
      take(&cycles, 8);
      run_for(cycles);
    } else if (asked == 'H') {
      uint16_t more;
      take(&more, 2);
      const int idle = to_board.head == to_board.tail;
      for (uint8_t byte; more; more--) take(&byte, 1), to_board.bytes[to_board.head++ % ROOM] = byte;
      if (idle && to_board.head != to_board.tail) avr_cycle_timer_register(avr, HOST_BYTE, next_from_host, NULL);
    } else if (asked == 'S') {
      uint8_t byte;
      take(&byte, 1);
      stray = byte;
    } else if (asked == 'X') {
      to_board.head = to_board.tail = 0;
      avr_reset(avr);
    } else {
      return 7;
    }
  }
}
