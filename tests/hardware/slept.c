// A computer that woke up, for processes that load this first: CLOCK_BOOTTIME, which goes on in a sleep, is ahead of
// CLOCK_MONOTONIC, which does not, by as many seconds as stand in the file that the variable SLEPT names.

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static long slept(void) {
  const char *name = getenv("SLEPT");
  FILE *file = name ? fopen(name, "r") : NULL;
  double seconds = 0.0;
  if (file && fscanf(file, "%lf", &seconds) != 1) seconds = 0.0;
  if (file) fclose(file);
  return (long)seconds;
}

int clock_gettime(clockid_t clock, struct timespec *time) {
  static int (*real)(clockid_t, struct timespec *);
  if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
  const int found = real(clock, time);
  if (clock == CLOCK_BOOTTIME && !found) time->tv_sec += slept();
  return found;
}
