-- cubes.db: the trained field of a map. Version 2.0, application_id 0x47444643 ("GDFC").
-- Digests are 16 bytes: low half, then high half, little-endian. Lengths are metres.

-- Free text: "map_id", "geometry" and what training keeps.
CREATE TABLE meta (
  key TEXT PRIMARY KEY NOT NULL,
  value TEXT NOT NULL
);

-- One row for each tile that was looked at, small, so that listing tiles never reads cubes.
CREATE TABLE tiles (
  id INTEGER PRIMARY KEY,
  level INTEGER NOT NULL,
  x INTEGER NOT NULL,
  y INTEGER NOT NULL,
  z INTEGER NOT NULL,
  surroundings BLOB NOT NULL,      -- XXH3-128 of tile_blobs.surrounding_tiles
  configuration BLOB NOT NULL,     -- digest of the fit configuration and version
  content BLOB NOT NULL,           -- digest of what the tile says of the field
  served BLOB NOT NULL,            -- mask of the cubes that have Gaussians, see occupied.mask
  num_cubes INTEGER NOT NULL,
  num_populated INTEGER NOT NULL,
  num_poor INTEGER NOT NULL,
  num_failed INTEGER NOT NULL,
  num_gaussians INTEGER NOT NULL,
  num_measured INTEGER NOT NULL,   -- cubes that have Gaussians and a known mean absolute error
  mean_mae REAL NOT NULL,          -- over the measured cubes; 0 without any
  max_mae REAL NOT NULL,
  num_bytes INTEGER NOT NULL,      -- of tile_blobs.data
  checksum INTEGER NOT NULL,       -- XXH3-64 of tile_blobs.data
  UNIQUE (level, x, y, z)
);

-- The cubes of a tile and the points that they were trained from, encoded as tile_format.md says.
CREATE TABLE tile_blobs (
  tile INTEGER PRIMARY KEY REFERENCES tiles (id),
  surrounding_tiles BLOB NOT NULL,
  data BLOB NOT NULL
);

-- Level-0 tiles that hold points. The mask has 512 bits as eight 64-bit words, little-endian; the cube
-- with index i = x + 8 * (y + 8 * z) in its tile is bit i % 64 of word i / 64.
CREATE TABLE occupied (
  x INTEGER NOT NULL,
  y INTEGER NOT NULL,
  z INTEGER NOT NULL,
  mask BLOB NOT NULL CHECK (length(mask) = 64),
  UNIQUE (x, y, z)
);
