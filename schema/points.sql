-- points.db: the point clouds of a map, compressed (SQLite; application_id "gdfp", user_version
-- 1000 · major + minor). Written by gdfmap ingest, read by gdfmap train.
--
-- Rows of a source with published = 0 belong to an ingest that runs or was interrupted: every reader
-- passes over them, and the next writer deletes them.
-- 64-bit unsigned numbers are stored as SQLite's signed integers with the same bits; 128-bit digests
-- as 16-byte blobs (low half first, little-endian) or as two such integers.
--
-- Minor versions: 2.1 added sensor_x, sensor_y, sensor_z and alignment to sources; a writer adds them to
-- an older file (ALTER TABLE), a reader takes them for not known.

-- Free text: map_id, geometry.
CREATE TABLE meta (
  key   TEXT PRIMARY KEY NOT NULL,
  value TEXT NOT NULL
);

-- One row per ingested cloud. Ids are never used again: people keep them.
-- num_read = num_stored + num_duplicates + num_thinned + the five num_rejected_*.
CREATE TABLE sources (
  id                        INTEGER PRIMARY KEY AUTOINCREMENT,
  published                 INTEGER NOT NULL DEFAULT 0,
  path                      TEXT    NOT NULL,             -- as given, for people
  parameters                TEXT    NOT NULL,             -- canonical text of the ingest options
  voxel_steps               INTEGER NOT NULL DEFAULT 0,   -- edge of a thinning voxel in quantisation
                                                          --   steps (block_format.md); 0: not thinned
  identity                  BLOB,                         -- of the file's bytes and the parameters
  num_bytes                 INTEGER NOT NULL DEFAULT 0,   -- size of the file
  num_read                  INTEGER NOT NULL DEFAULT 0,
  num_stored                INTEGER NOT NULL DEFAULT 0,
  num_duplicates            INTEGER NOT NULL DEFAULT 0,   -- equal to another point of their block
  num_thinned               INTEGER NOT NULL DEFAULT 0,   -- given up for another point of their voxel
  num_rejected_not_finite   INTEGER NOT NULL DEFAULT 0,
  num_rejected_withheld     INTEGER NOT NULL DEFAULT 0,
  num_rejected_zero         INTEGER NOT NULL DEFAULT 0,
  num_rejected_out_of_range INTEGER NOT NULL DEFAULT 0,   -- beyond the lattice
  num_rejected_outside      INTEGER NOT NULL DEFAULT 0,   -- not in the region asked for
  sensor_x                  REAL,                         -- where the sensor stood, in the map's
  sensor_y                  REAL,                         --   frame, metres; NULL: not known. No part
  sensor_z                  REAL,                         --   of the identity
  alignment                 TEXT    NOT NULL DEFAULT ''   -- how registration moved the points after
                                                          --   the transform of parameters: method,
                                                          --   matrix and figures; empty: it did not
);
CREATE UNIQUE INDEX sources_by_identity ON sources (identity) WHERE published = 1;

-- Level-0 tiles by key: points have no other level.
CREATE TABLE tiles (
  id INTEGER PRIMARY KEY,
  x  INTEGER NOT NULL,
  y  INTEGER NOT NULL,
  z  INTEGER NOT NULL,
  UNIQUE (x, y, z)
);

-- What one source put into one tile: sums over its blocks, brought up to date with every block, so
-- that publication is the change of a single row and a listing of tiles reads no blocks.
CREATE TABLE tile_sources (
  tile        INTEGER NOT NULL REFERENCES tiles (id),
  source      INTEGER NOT NULL REFERENCES sources (id),
  digest_low  INTEGER NOT NULL,  -- sum modulo 2^128 of the hashes of every accepted point's world
  digest_high INTEGER NOT NULL,  --   lattice coordinates, before duplicates go and voxels are thinned
  num_points  INTEGER NOT NULL,  -- stored
  num_blocks  INTEGER NOT NULL,
  block_bytes INTEGER NOT NULL,
  cubes_0     INTEGER NOT NULL,  -- occupied cubes, one word for each layer z of the tile: bit x + 8·y
  cubes_1     INTEGER NOT NULL,
  cubes_2     INTEGER NOT NULL,
  cubes_3     INTEGER NOT NULL,
  cubes_4     INTEGER NOT NULL,
  cubes_5     INTEGER NOT NULL,
  cubes_6     INTEGER NOT NULL,
  cubes_7     INTEGER NOT NULL,
  PRIMARY KEY (tile, source)
) WITHOUT ROWID;
CREATE INDEX tile_sources_by_source ON tile_sources (source);

-- Compressed points (block_format.md). A tile's point set is the union of its published blocks, in
-- which all sources of one voxel_steps are thinned together.
CREATE TABLE blocks (
  id         INTEGER PRIMARY KEY,
  tile       INTEGER NOT NULL REFERENCES tiles (id),
  source     INTEGER NOT NULL REFERENCES sources (id),
  sequence   INTEGER NOT NULL,  -- counts the source's blocks of this tile from 0
  num_points INTEGER NOT NULL,
  checksum   INTEGER NOT NULL,  -- XXH3-64 of data
  data       BLOB    NOT NULL
);
CREATE UNIQUE INDEX blocks_by_tile ON blocks (tile, source, sequence);
