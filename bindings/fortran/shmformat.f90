! The C interface of libshmformat for Fortran 2003. bindings/c/include/shmformat.h is the manual.
! Compile this file with your program, and link it with -lshmformat_c.
!
! Names, constants and the order of arguments are the same as in C. Indices of blocks, arrays,
! vertices and cells begin at 0. In each type, struct_size is initialized to the size of the type.
! Strings must end with c_null_char. Pass arrays with c_loc().
module shmformat
  use, intrinsic :: iso_c_binding
  implicit none
  public

  integer(c_int), parameter :: SHMF_OK = 0, SHMF_IO = 1, SHMF_TRUNCATED = 2, SHMF_CORRUPT = 3, &
      SHMF_UNSUPPORTED = 4, SHMF_OVER_LIMIT = 5, SHMF_MISUSE = 6, SHMF_OUTPUT = 7, SHMF_NO_MEMORY = 8, &
      SHMF_CANCELLED = 9
  integer(c_int32_t), parameter :: SHMF_INT8 = 1, SHMF_UINT8 = 2, SHMF_INT16 = 3, SHMF_UINT16 = 4, &
      SHMF_INT32 = 5, SHMF_UINT32 = 6, SHMF_INT64 = 7, SHMF_UINT64 = 8, SHMF_FLOAT32 = 9, SHMF_FLOAT64 = 10
  integer(c_int32_t), parameter :: SHMF_TRIANGLE = 3, SHMF_QUAD = 4, SHMF_TETRAHEDRON = 6, SHMF_PYRAMID = 7, &
      SHMF_WEDGE = 8, SHMF_HEXAHEDRON = 9
  integer(c_int32_t), parameter :: SHMF_LAGRANGE = 0, SHMF_SERENDIPITY = 1, SHMF_BEZIER = 2
  integer(c_int32_t), parameter :: SHMF_POINT_DATA = 0, SHMF_CELL_DATA = 1, SHMF_GLOBAL_DATA = 2, &
      SHMF_NODE_SET_DATA = 3, SHMF_SIDE_SET_DATA = 4, SHMF_ELEMENT_SET_DATA = 5
  integer(c_int32_t), parameter :: SHMF_ORDER_KEEP = 0, SHMF_ORDER_STREAM = 1, SHMF_ORDER_FREE = 2
  integer(c_int32_t), parameter :: SHMF_LEVEL_DEFAULT = 0, SHMF_LEVEL_FAST = 1, SHMF_LEVEL_BEST = 2
  integer(c_int32_t), parameter :: SHMF_POINTS = 1, SHMF_CORNERS = 2, SHMF_CORNER_BEGIN = 3, &
      SHMF_CELL_BLOCKS = 4, SHMF_CELL_TYPES = 5, SHMF_VERTEX_NUMBERS = 6, SHMF_CELL_NUMBERS = 7, SHMF_VALUES = 8
  integer(c_int32_t), parameter :: SHMF_FILL = 1

  type, bind(c) :: shmf_error
    integer(c_int32_t) :: status = 0, reserved = 0
    integer(c_int64_t) :: offset = -1
    character(kind=c_char) :: section(120), detail(360), message(528)
  end type

  type, bind(c) :: shmf_info
    integer(c_size_t) :: struct_size = 96
    integer(c_int64_t) :: vertices = 0, cells = 0, hexahedra = 0, steps = 0, file_bytes = 0
    integer(c_int32_t) :: blocks = 0, arrays = 0, segments = 0, coordinate_type = 0, order = 0, has_digest = 0
    type(c_ptr) :: source_format = c_null_ptr
    real(c_double) :: coordinate_error = 0
    integer(c_int64_t) :: digest = 0
  end type

  type, bind(c) :: shmf_block
    integer(c_size_t) :: struct_size = 48
    integer(c_int64_t) :: id = 0
    type(c_ptr) :: name = c_null_ptr
    integer(c_int32_t) :: shape = SHMF_HEXAHEDRON, nodes_per_cell = 8
    integer(c_int64_t) :: cells = 0
    integer(c_int32_t) :: node_scheme = SHMF_LAGRANGE, reserved = 0
  end type

  type, bind(c) :: shmf_array
    integer(c_size_t) :: struct_size = 88
    type(c_ptr) :: name = c_null_ptr, role = c_null_ptr
    integer(c_int32_t) :: location = SHMF_POINT_DATA, type = SHMF_FLOAT64, components = 1, per_step = 0
    integer(c_int64_t) :: elements = 0
    type(c_ptr) :: blocks = c_null_ptr
    integer(c_int32_t) :: block_count = 0, fill_count = 0
    real(c_double) :: error = 0, relative_error = 0
    type(c_ptr) :: fills = c_null_ptr
  end type

  type, bind(c) :: shmf_counts
    integer(c_size_t) :: struct_size = 32
    integer(c_int64_t) :: vertices = 0, cells = 0, corners = 0
  end type

  type, bind(c) :: shmf_target
    integer(c_size_t) :: struct_size = 56
    integer(c_int32_t) :: what = SHMF_POINTS, type = SHMF_FLOAT64, array = 0, flags = 0
    integer(c_int64_t) :: step = 0
    type(c_ptr) :: data = c_null_ptr
    integer(c_int64_t) :: bytes = 0, used = 0
  end type

  type, bind(c) :: shmf_write_options
    integer(c_size_t) :: struct_size = 64
    integer(c_int32_t) :: order = SHMF_ORDER_KEEP, level = SHMF_LEVEL_DEFAULT, coordinate_type = SHMF_FLOAT64, &
        threads = 0
    real(c_double) :: coordinate_error = 0
    integer(c_int64_t) :: segment_cells = 0
    type(c_ptr) :: source_format = c_null_ptr
    integer(c_int32_t) :: replace = 0, key_steps = 0
    integer(c_int32_t) :: live = 0
  end type

  interface
    integer(c_int) function shmf_open_path(path, options, file, error) bind(c)
      import :: c_int, c_char, c_ptr, shmf_error
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr), value :: options
      type(c_ptr), intent(out) :: file
      type(shmf_error), intent(inout) :: error
    end function
    subroutine shmf_close(file) bind(c)
      import :: c_ptr
      type(c_ptr), value :: file
    end subroutine
    integer(c_int) function shmf_get_info(file, info, error) bind(c)
      import :: c_int, c_ptr, shmf_info, shmf_error
      type(c_ptr), value :: file
      type(shmf_info), intent(inout) :: info
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_get_array(file, array, info, error) bind(c)
      import :: c_int, c_int32_t, c_ptr, shmf_array, shmf_error
      type(c_ptr), value :: file
      integer(c_int32_t), value :: array
      type(shmf_array), intent(inout) :: info
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int64_t) function shmf_find_array(file, location, name) bind(c)
      import :: c_int32_t, c_int64_t, c_char, c_ptr
      type(c_ptr), value :: file
      integer(c_int32_t), value :: location
      character(kind=c_char), intent(in) :: name(*)
    end function
    integer(c_int) function shmf_select(file, selection, run, counts, error) bind(c)
      import :: c_int, c_ptr, shmf_counts, shmf_error
      type(c_ptr), value :: file, selection, run
      type(shmf_counts), intent(inout) :: counts
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_read(file, targets, count, run, error) bind(c)
      import :: c_int, c_size_t, c_ptr, shmf_target, shmf_error
      type(c_ptr), value :: file, run
      type(shmf_target), intent(inout) :: targets(*)
      integer(c_size_t), value :: count
      type(shmf_error), intent(inout) :: error
    end function

    integer(c_int) function shmf_writer_path(path, options, writer, error) bind(c)
      import :: c_int, c_char, c_ptr, shmf_write_options, shmf_error
      character(kind=c_char), intent(in) :: path(*)
      type(shmf_write_options), intent(in) :: options
      type(c_ptr), intent(out) :: writer
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_block(writer, block, error) bind(c)
      import :: c_int, c_ptr, shmf_block, shmf_error
      type(c_ptr), value :: writer
      type(shmf_block), intent(in) :: block
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_array(writer, array, error) bind(c)
      import :: c_int, c_ptr, shmf_array, shmf_error
      type(c_ptr), value :: writer
      type(shmf_array), intent(in) :: array
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_mesh(writer, arrays, count, error) bind(c)
      import :: c_int, c_size_t, c_ptr, shmf_target, shmf_error
      type(c_ptr), value :: writer
      type(shmf_target), intent(in) :: arrays(*)
      integer(c_size_t), value :: count
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_values(writer, array, step, values, bytes, error) bind(c)
      import :: c_int, c_int32_t, c_int64_t, c_ptr, shmf_error
      type(c_ptr), value :: writer, values
      integer(c_int32_t), value :: array
      integer(c_int64_t), value :: step, bytes
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_times(writer, times, count, error) bind(c)
      import :: c_int, c_int64_t, c_double, c_ptr, shmf_error
      type(c_ptr), value :: writer
      real(c_double), intent(in) :: times(*)
      integer(c_int64_t), value :: count
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_commit(writer, error) bind(c)
      import :: c_int, c_ptr, shmf_error
      type(c_ptr), value :: writer
      type(shmf_error), intent(inout) :: error
    end function
    integer(c_int) function shmf_writer_finish(writer, bytes, error) bind(c)
      import :: c_int, c_int64_t, c_ptr, shmf_error
      type(c_ptr), value :: writer
      integer(c_int64_t), intent(out) :: bytes
      type(shmf_error), intent(inout) :: error
    end function
    subroutine shmf_writer_free(writer) bind(c)
      import :: c_ptr
      type(c_ptr), value :: writer
    end subroutine
  end interface

contains

  ! Converts a C string in a shmf_error to a Fortran string.
  pure function shmf_text(chars) result(text)
    character(kind=c_char), intent(in) :: chars(:)
    character(len=size(chars)) :: text
    integer :: i
    text = ''
    do i = 1, size(chars)
      if (chars(i) == c_null_char) exit
      text(i:i) = chars(i)
    end do
  end function
end module
