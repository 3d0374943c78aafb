"""The archive of raw data: chunks and tables as a Parquet dataset in a folder or an S3-compatible store."""
