/* Writes all data of a .shm file: for each array a line "WHAT TYPE STEP BYTES NAME", followed by
 * its values. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include "shmformat.h"

static shmf_error why;

static void put(const char* what, const shmf_target* one, const char* name) {
  printf("%s %d %" PRIu64 " %" PRIu64 " %s\n", what, (int)one->type, one->step, one->used, name);
  fwrite(one->data, 1, one->used, stdout);
}

/* Asks the library for the size of the data, allocates memory, and reads the data. */
static int read_targets(shmf_file* file, shmf_target* all, size_t count) {
  if (shmf_read(file, all, count, NULL, &why) != SHMF_OK) return why.status;
  for (size_t i = 0; i < count; ++i) {
    all[i].bytes = all[i].used;
    if ((all[i].data = malloc(all[i].used + 1)) == NULL) return SHMF_NO_MEMORY;
  }
  return shmf_read(file, all, count, NULL, &why);
}

static const char* const kMesh[] = {"points", "corners", "offsets", "blocks", "types"};
static const char* const kPlaces[] = {"point",    "cell",     "global",
                                      "node_set", "side_set", "element_set"};
static const int32_t kTypes[] = {0, SHMF_INT64, SHMF_INT64, SHMF_UINT32, SHMF_UINT8};

static shmf_target want(int32_t what, int32_t type, uint32_t array) {
  return (shmf_target){sizeof(shmf_target), what, type, array, SHMF_FILL, 0, NULL, 0, 0};
}

/* Reads the mesh and all arrays without time steps in one pass, and prints them. */
static int put_mesh(shmf_file* file, const shmf_info* info, shmf_array* arrays) {
  shmf_target* all = calloc(5 + (size_t)info->arrays, sizeof *all);
  size_t count = 5;
  if (all == NULL) return SHMF_NO_MEMORY;
  for (int i = 0; i < 5; ++i) all[i] = want(i + 1, i ? kTypes[i] : info->coordinate_type, 0);
  for (uint32_t a = 0; a < info->arrays; ++a)
    if (!arrays[a].per_step) all[count++] = want(SHMF_VALUES, arrays[a].type, a);
  const int status = read_targets(file, all, count);
  for (size_t i = 0; i < count && status == SHMF_OK; ++i) {
    const shmf_array* array = i < 5 ? NULL : &arrays[all[i].array];
    put(array ? kPlaces[array->location] : kMesh[i], &all[i], array ? array->name : "");
  }
  for (size_t i = 0; i < count; ++i) free(all[i].data);
  free(all);
  return status;
}

static int put_steps(shmf_file* file, uint32_t index, const shmf_array* array) {
  const uint64_t* steps;
  uint64_t count = 1;
  for (uint64_t i = 0; i < count; ++i) {
    shmf_target one = want(SHMF_VALUES, array->type, index);
    if (shmf_get_steps(file, index, &steps, &count, &why) != SHMF_OK) return why.status;
    if (i == count) break;
    one.step = steps[i];
    const int status = read_targets(file, &one, 1);
    if (status == SHMF_OK) printf("step "), put(kPlaces[array->location], &one, array->name);
    free(one.data);
    if (status != SHMF_OK) return status;
  }
  return SHMF_OK;
}

static int put_sets(shmf_file* file) {
  uint64_t count;
  if (shmf_set_count(file, &count, &why) != SHMF_OK) return why.status;
  for (uint64_t i = 0; i < count; ++i) {
    shmf_set set = {.struct_size = sizeof set};
    if (shmf_get_set(file, i, &set, &why) != SHMF_OK) return why.status;
    printf("set %d %" PRId64 " %" PRIu64 " %s\n", SHMF_UINT64, set.id, set.members * 8, set.name);
    fwrite(set.numbers, 8, set.members, stdout);
  }
  return SHMF_OK;
}

int main(int argc, char** argv) {
  shmf_file* file = NULL;
  shmf_info info = {.struct_size = sizeof info};
  const shmf_open_options how = {.struct_size = sizeof how, .damaged = argc > 2};
  if (argc < 2) return fprintf(stderr, "usage: read_all FILE.shm [damaged]\n"), SHMF_MISUSE;
  int status = shmf_open_path(argv[1], &how, &file, &why);
  if (status == SHMF_OK) status = shmf_get_info(file, &info, &why);
  shmf_array* arrays = calloc((size_t)info.arrays + 1, sizeof *arrays);
  if (arrays == NULL) status = SHMF_NO_MEMORY;
  for (uint32_t a = 0; a < info.arrays && status == SHMF_OK; ++a) {
    arrays[a].struct_size = sizeof *arrays;
    status = shmf_get_array(file, a, &arrays[a], &why);
  }
  if (status == SHMF_OK) status = put_mesh(file, &info, arrays);
  for (uint32_t a = 0; a < info.arrays && status == SHMF_OK; ++a)
    if (arrays[a].per_step) status = put_steps(file, a, &arrays[a]);
  if (status == SHMF_OK) status = put_sets(file);
  if (status != SHMF_OK) fprintf(stderr, "%s\n", why.message);
  free(arrays);
  shmf_close(file);
  return status;
}
