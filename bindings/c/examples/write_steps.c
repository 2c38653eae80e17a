/* Writes a bar of hexahedra with a temperature at three time steps, as a solver would.
     cc write_steps.c $(pkg-config --cflags --libs shmformat-c) -o write_steps
     ./write_steps bar.shm */
#include <stdio.h>

#include "shmformat.h"

enum { CELLS = 100, VERTICES = 4 * (CELLS + 1) };

static double points[VERTICES][3], temperature[VERTICES];
static int32_t corners[CELLS][8];

int main(int argc, char** argv) {
  shmf_error why;
  shmf_writer* writer;
  shmf_block block = {sizeof block, 1, "bar", SHMF_HEXAHEDRON, 8};
  shmf_array array = {sizeof array};
  shmf_target mesh[2] = {{sizeof *mesh, SHMF_POINTS, SHMF_FLOAT64},
                         {sizeof *mesh, SHMF_CORNERS, SHMF_INT32}};
  const double times[3] = {0, 0.5, 1};

  if (argc != 2) return fprintf(stderr, "usage: write_steps FILE.shm\n"), SHMF_MISUSE;
  for (int v = 0; v < VERTICES; ++v) { /* each layer has four vertices around the x axis */
    points[v][0] = v / 4 * 0.1;
    points[v][1] = v % 4 == 1 || v % 4 == 2;
    points[v][2] = v % 4 >= 2;
  }
  for (int c = 0; c < CELLS; ++c)
    for (int i = 0; i < 8; ++i) corners[c][i] = 4 * c + i;
  array.name = "temperature";
  array.location = SHMF_POINT_DATA;
  array.type = SHMF_FLOAT64;
  array.per_step = 1;
  mesh[0].data = points;
  mesh[0].bytes = sizeof points;
  mesh[1].data = corners;
  mesh[1].bytes = sizeof corners;

  /* After a failure all later calls fail too, so it is enough to check the final call. */
  if (shmf_writer_path(argv[1], NULL, &writer, &why) == SHMF_OK) {
    shmf_writer_block(writer, &block, NULL);
    shmf_writer_array(writer, &array, NULL);
    shmf_writer_mesh(writer, mesh, 2, NULL);
    for (int step = 0; step < 3; ++step) {
      for (int v = 0; v < VERTICES; ++v) temperature[v] = 300 + points[v][0] * times[step];
      shmf_writer_values(writer, 0, step, temperature, sizeof temperature, NULL);
    }
    shmf_writer_times(writer, times, 3, NULL);
    const shmf_status status = shmf_writer_finish(writer, NULL, &why);
    shmf_writer_free(writer);
    if (status == SHMF_OK) return 0;
  }
  fprintf(stderr, "%s\n", why.message);
  return why.status;
}
