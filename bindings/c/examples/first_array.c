/* Prints the number of vertices and the number of cells of a .shm file, and the smallest and
   largest value of its first floating-point array. If the array has time steps, prints the values
   of its final step.
     cc first_array.c $(pkg-config --cflags --libs shmformat-c) -o first_array
     ./first_array run.shm */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "shmformat.h"

static int failed(shmf_file* file, const shmf_error* why) {
  fprintf(stderr, "%s\n", why->message);
  shmf_close(file); /* `file` is NULL if opening failed */
  return why->status;
}

int main(int argc, char** argv) {
  shmf_error why;
  shmf_file* file;
  shmf_info info = {sizeof info};
  shmf_array array = {sizeof array};
  shmf_target want = {sizeof want};
  const uint64_t* steps;
  uint64_t count;

  if (argc != 2) return fprintf(stderr, "usage: first_array FILE.shm\n"), SHMF_MISUSE;
  if (shmf_open_path(argv[1], NULL, &file, &why) != SHMF_OK) return failed(file, &why);
  if (shmf_get_info(file, &info, &why) != SHMF_OK) return failed(file, &why);
  printf("%" PRIu64 " vertices, %" PRIu64 " cells\n", info.vertices, info.cells);

  want.what = SHMF_VALUES;
  for (; want.array < info.arrays; ++want.array) {
    if (shmf_get_array(file, want.array, &array, &why) != SHMF_OK) return failed(file, &why);
    if (array.type == SHMF_FLOAT64 || array.type == SHMF_FLOAT32) break;
  }
  if (want.array == info.arrays) return puts("no array of floats"), shmf_close(file), 0;
  if (shmf_get_steps(file, want.array, &steps, &count, &why) != SHMF_OK) return failed(file, &why);
  if (count > 0) want.step = steps[count - 1];

  want.type = array.type;
  if (shmf_read(file, &want, 1, NULL, &why) != SHMF_OK)
    return failed(file, &why); /* the call sets want.used, the size of the array in bytes */
  want.data = malloc(want.used);
  want.bytes = want.used;
  if (shmf_read(file, &want, 1, NULL, &why) != SHMF_OK) return failed(file, &why);

  double least = 0, most = 0;
  for (uint64_t i = 0; i < want.used / shmf_type_bytes(want.type); ++i) {
    const double value =
        want.type == SHMF_FLOAT64 ? ((double*)want.data)[i] : ((float*)want.data)[i];
    if (i == 0 || value < least) least = value;
    if (i == 0 || value > most) most = value;
  }
  printf("%s: %g to %g\n", array.name, least, most);
  free(want.data);
  shmf_close(file);
  return 0;
}
