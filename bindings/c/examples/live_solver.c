/* Writes a bar of hexahedra with a temperature, one time step after the other, as a solver would.
   Each step is readable as soon as it is committed, even if the solver is killed later.
     cc live_solver.c $(pkg-config --cflags --libs shmformat-c) -o live_solver
     ./live_solver bar.shm 20
     shm info bar.shm */
#include <stdio.h>
#include <stdlib.h>

#include "shmformat.h"

enum { CELLS = 100, VERTICES = 4 * (CELLS + 1), MOST_STEPS = 10000 };

static double points[VERTICES][3], temperature[VERTICES], times[MOST_STEPS];
static int32_t corners[CELLS][8];

int main(int argc, char** argv) {
  shmf_error why;
  shmf_writer* writer;
  shmf_write_options options = {sizeof options};
  shmf_block block = {sizeof block, 1, "bar", SHMF_HEXAHEDRON, 8};
  shmf_array array = {sizeof array};
  shmf_target mesh[2] = {{sizeof *mesh, SHMF_POINTS, SHMF_FLOAT64},
                         {sizeof *mesh, SHMF_CORNERS, SHMF_INT32}};
  const int steps = argc == 3 ? atoi(argv[2]) : -1;
  if (steps < 0 || steps > MOST_STEPS)
    return fprintf(stderr, "usage: live_solver FILE.shm STEPS\n"), SHMF_MISUSE;
  for (int v = 0; v < VERTICES; ++v) { /* each layer has four vertices around the x axis */
    points[v][0] = v / 4 * 0.1;
    points[v][1] = v % 4 == 1 || v % 4 == 2;
    points[v][2] = v % 4 >= 2;
  }
  for (int c = 0; c < CELLS; ++c)
    for (int i = 0; i < 8; ++i) corners[c][i] = 4 * c + i;
  options.live = options.replace = 1;
  array.name = "temperature";
  array.location = SHMF_POINT_DATA;
  array.type = SHMF_FLOAT64;
  array.per_step = 1;
  mesh[0].data = points;
  mesh[0].bytes = sizeof points;
  mesh[1].data = corners;
  mesh[1].bytes = sizeof corners;

  shmf_status status = shmf_writer_path(argv[1], &options, &writer, &why);
  if (status == SHMF_OK) {
    shmf_writer_block(writer, &block, NULL);
    shmf_writer_array(writer, &array, NULL);
    status = shmf_writer_mesh(writer, mesh, 2, &why);
    for (int step = 0; step < steps && status == SHMF_OK; ++step) {
      times[step] = 0.5 * step;
      for (int v = 0; v < VERTICES; ++v) temperature[v] = 300 + points[v][0] * times[step];
      shmf_writer_values(writer, 0, (uint64_t)step, temperature, sizeof temperature, NULL);
      shmf_writer_times(writer, times, (uint64_t)step + 1, NULL);
      status = shmf_writer_commit(writer, &why); /* the first error of the three calls */
      if (status == SHMF_OK) printf("step %d is committed\n", step), fflush(stdout);
    }
    if (status == SHMF_OK) status = shmf_writer_finish(writer, NULL, &why);
    shmf_writer_free(writer);
  }
  if (status != SHMF_OK) fprintf(stderr, "%s\n", why.message);
  return status;
}
